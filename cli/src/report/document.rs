//! A document as Markdown with separate pictures, and as a single HTML file.

/// A document. Texts are inline Markdown: `code` and **strong**.
pub struct Document {
    title: String,
    markdown: String,
    /// As HTML, with its pictures.
    body: String,
}

const STYLE: &str = "\
body{font:16px/1.5 system-ui,sans-serif;max-width:68em;margin:2em auto;padding:0 1em;color:#222}
table{border-collapse:collapse;font-size:14px;display:block;overflow-x:auto}
td,th{border:1px solid #ccc;padding:.3em .5em;text-align:left;vertical-align:top}
th{background:#f3f3f3}
svg{max-width:100%;height:auto;margin-top:2em}
code{background:#f3f3f3}
.yes{background:#dcf0e4}
.no{background:#f8dcd0}
.open{background:#f4eed2}
";

impl Document {
    pub fn new(title: &str) -> Self {
        Self {
            title: title.into(),
            markdown: format!("# {title}\n"),
            body: element("h1", title) + "\n",
        }
    }

    pub fn heading(&mut self, text: &str) {
        self.add(&format!("## {text}\n"), &element("h2", text));
    }

    pub fn text(&mut self, text: &str) {
        self.add(&format!("{text}\n"), &element("p", text));
    }

    pub fn list(&mut self, items: impl IntoIterator<Item = String>) {
        let items: Vec<String> = items.into_iter().collect();
        let markdown: String = items.iter().map(|item| format!("- {item}\n")).collect();
        let html: String = items.iter().map(|item| element("li", item) + "\n").collect();
        self.add(&markdown, &format!("<ul>\n{html}</ul>"));
    }

    pub fn table<H: AsRef<str>>(&mut self, head: &[H], rows: impl IntoIterator<Item = Vec<String>>) {
        let head: Vec<String> = head.iter().map(|cell| cell.as_ref().into()).collect();
        let rows: Vec<Vec<String>> = rows.into_iter().collect();
        let row = |cells: &Vec<String>| format!("| {} |\n", cells.join(" | "));
        let line = "|---".repeat(head.len()) + "|\n";
        let markdown: String = [row(&head), line].into_iter().chain(rows.iter().map(row)).collect();
        let cells = |tag: &str, cells: &[String]| cells.iter().map(|cell| element(tag, cell)).collect::<String>();
        let body: String = rows.iter().map(|row| format!("<tr>{}</tr>\n", cells("td", row))).collect();
        let head = cells("th", &head);
        self.add(
            &markdown,
            &format!("<table><thead><tr>{head}</tr></thead><tbody>\n{body}</tbody></table>"),
        );
    }

    /// Adds a picture and its caption; `name` is that of its files.
    pub fn picture(&mut self, name: &str, caption: &str, svg: &str) {
        self.add(&format!("![{name}]({name}.png)\n"), &format!("<p>{svg}</p>"));
        self.text(&format!("{}: {caption}", titled(name)));
    }

    fn add(&mut self, markdown: &str, html: &str) {
        self.markdown.push('\n');
        self.markdown.push_str(markdown);
        self.body.push_str(html);
        self.body.push('\n');
    }

    /// As Markdown, with links to the PNG files.
    pub fn markdown(&self) -> &str {
        &self.markdown
    }

    /// As one HTML file.
    pub fn html(&self) -> String {
        let mut body = self.body.clone();
        for word in ["yes", "no", "open"] {
            for (cell, end) in [("<td>", " "), ("<td><strong>", "</strong>")] {
                let coloured = cell.replace("<td>", &format!("<td class=\"{word}\">"));
                body = body.replace(&format!("{cell}{word}{end}"), &format!("{coloured}{word}{end}"));
            }
        }
        let title = escaped(&self.title);
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width\">\n<title>{title}</title>\n\
             <style>\n{STYLE}</style>\n</head>\n<body>\n{body}</body>\n</html>\n"
        )
    }
}

/// A text as an HTML element.
fn element(tag: &str, text: &str) -> String {
    format!("<{tag}>{}</{tag}>", inline(text))
}

/// Converts inline Markdown to HTML: every other part between delimiters is code or strong.
fn inline(text: &str) -> String {
    let (mut html, mut is_strong) = (String::new(), false);
    for (part, text) in text.trim().split('`').enumerate() {
        if part % 2 == 1 {
            html += &format!("<code>{}</code>", escaped(text));
            continue;
        }
        for (part, text) in text.split("**").enumerate() {
            if part > 0 {
                html += if is_strong { "</strong>" } else { "<strong>" };
                is_strong = !is_strong;
            }
            html += &escaped(text);
        }
    }
    html
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Formats `figure-22-detectors` as "Figure 22 detectors", without the folder.
fn titled(name: &str) -> String {
    let name = name.rsplit('/').next().unwrap_or(name);
    let text = name.replace('-', " ").replace(" 0", " ");
    let mut letters = text.chars();
    letters
        .next()
        .map(|first| first.to_uppercase().chain(letters).collect())
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn document() -> Document {
        let mut document = Document::new("A & B");
        document.text("see `x < y`");
        document.table(&["a", "b"], [vec!["**yes**".into(), "1".into()], vec!["no 2".into(), "not".into()]]);
        document.picture("figure-08", "a row", "<svg></svg>");
        document
    }

    #[test]
    fn markdown_names_its_pictures() {
        let document = document();
        let text = document.markdown();
        assert!(text.contains("| a | b |\n|---|---|\n| **yes** | 1 |"), "{text}");
        assert!(text.contains("![figure-08](figure-08.png)\n\nFigure 8: a row"), "{text}");
    }

    #[test]
    fn html_holds_its_pictures_and_escapes_text() {
        let text = document().html();
        assert!(
            text.contains("<code>x &lt; y</code>") && text.contains("<h1>A &amp; B</h1>"),
            "{text}"
        );
        assert!(text.contains("<svg></svg>") && !text.contains("<img"), "{text}");
        assert!(text.contains("<td class=\"yes\"><strong>yes"), "{text}");
        assert!(text.contains("<td class=\"no\">no 2") && text.contains("<td>not<"), "{text}");
    }

    #[test]
    fn html_says_what_markdown_says() {
        use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd, html::push_html};
        let mut document = Document::new("A > \"B\" & C");
        document.heading("2 < 3");
        document.text("**Why `x` is** first: \"a\", b_c, x*y & 3 > 2 (`<svg> & co`).");
        document.list(["**one**: 1".into(), "two".into()]);
        document.table(
            &["a", "b & c"],
            [vec!["**no** ".into(), String::new()], vec!["open `1 < 2`".into(), "±2".into()]],
        );
        document.picture("a/figure-08", "a row", "<svg>1 &amp; 2</svg>");
        let events = Parser::new_ext(document.markdown(), Options::ENABLE_TABLES).filter_map(|event| match event {
            Event::Start(Tag::Image { .. }) => Some(Event::InlineHtml("<svg>1 &amp; 2</svg>".into())),
            Event::Text(name) if &*name == "a/figure-08" => None,
            Event::End(TagEnd::Image) => None,
            event => Some(event),
        });
        let mut html = String::new();
        push_html(&mut html, events);
        assert_eq!(document.body, html);
    }
}
