//! A document, written as Markdown beside its pictures, and as one HTML file that holds them.

use std::collections::HashMap;

use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd, html::push_html};

/// A document. Texts are Markdown.
pub struct Document {
    title: String,
    markdown: String,
    /// Drawings by the names of their files.
    pictures: HashMap<String, String>,
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
    /// An empty document.
    pub fn new(title: &str) -> Self {
        Self {
            title: title.into(),
            markdown: format!("# {title}\n"),
            pictures: HashMap::new(),
        }
    }

    /// Adds a heading.
    pub fn heading(&mut self, text: &str) {
        self.add(&format!("## {text}\n"));
    }

    /// Adds a paragraph.
    pub fn text(&mut self, text: &str) {
        self.add(&format!("{text}\n"));
    }

    /// Adds a list.
    pub fn list(&mut self, items: impl IntoIterator<Item = String>) {
        let items = items.into_iter().map(|item| format!("- {item}\n"));
        self.add(&items.collect::<String>());
    }

    /// Adds a table.
    pub fn table<H: AsRef<str>>(&mut self, head: &[H], rows: impl IntoIterator<Item = Vec<String>>) {
        let row = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
        let head: Vec<String> = head.iter().map(|cell| cell.as_ref().into()).collect();
        let line = "|---".repeat(head.len()) + "|\n";
        let rows: String = rows.into_iter().map(|cells| row(&cells)).collect();
        self.add(&(row(&head) + &line + &rows));
    }

    /// Adds a picture, which is in files of that name, and what stands under it.
    pub fn picture(&mut self, name: &str, caption: &str, svg: &str) {
        self.add(&format!("![{name}]({name}.png)\n\n{}: {caption}\n", titled(name)));
        self.pictures.insert(format!("{name}.png"), svg.into());
    }

    fn add(&mut self, block: &str) {
        self.markdown.push('\n');
        self.markdown.push_str(block);
    }

    /// As Markdown; pictures are the PNG files beside it.
    pub fn markdown(&self) -> &str {
        &self.markdown
    }

    /// As one HTML file.
    pub fn html(&self) -> String {
        let mut body = String::new();
        let mut is_drawn = false;
        let events = Parser::new_ext(&self.markdown, Options::ENABLE_TABLES);
        let events = events.filter_map(|event| match event {
            Event::Start(Tag::Image { ref dest_url, .. }) => {
                let svg = self.pictures.get(dest_url.as_ref());
                is_drawn = svg.is_some();
                Some(svg.map_or(event.clone(), |svg| Event::InlineHtml(svg.clone().into())))
            }
            // What a picture that is drawn would be called without it.
            Event::End(TagEnd::Image) if is_drawn => {
                is_drawn = false;
                None
            }
            event => (!is_drawn).then_some(event),
        });
        push_html(&mut body, events);
        for word in ["yes", "no", "open"] {
            for (cell, end) in [("<td>", " "), ("<td><strong>", "</strong>")] {
                let coloured = cell.replace("<td>", &format!("<td class=\"{word}\">"));
                body = body.replace(&format!("{cell}{word}{end}"), &format!("{coloured}{word}{end}"));
            }
        }
        let title = self.title.replace('&', "&amp;").replace('<', "&lt;");
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width\">\n<title>{title}</title>\n\
             <style>\n{STYLE}</style>\n</head>\n<body>\n{body}</body>\n</html>\n"
        )
    }
}

/// `figure-22-detectors` as "Figure 22 detectors", without the folder.
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
}
