//! A document that can be written as Markdown beside its pictures, and as one HTML file that holds them.

/// A document.
pub struct Document {
    title: String,
    blocks: Vec<Block>,
}

/// A part of it. Texts may hold `code` and **bold**.
pub enum Block {
    /// A heading.
    Heading(String),
    /// A paragraph.
    Text(String),
    /// A list.
    List(Vec<String>),
    /// A table.
    Table {
        head: Vec<String>,
        rows: Vec<Vec<String>>,
    },
    /// A picture, in files of that name, and what stands under it.
    Picture {
        name: String,
        caption: String,
        svg: String,
    },
}

impl Document {
    /// An empty document.
    pub fn new(title: &str) -> Self {
        Self {
            title: title.into(),
            blocks: Vec::new(),
        }
    }

    /// Adds a part.
    pub fn push(&mut self, block: Block) {
        self.blocks.push(block);
    }

    /// Adds a heading.
    pub fn heading(&mut self, text: &str) {
        self.push(Block::Heading(text.into()));
    }

    /// Adds a paragraph.
    pub fn text(&mut self, text: impl Into<String>) {
        self.push(Block::Text(text.into()));
    }

    /// As Markdown; pictures are the PNG files beside it.
    pub fn markdown(&self) -> String {
        let blocks = self.blocks.iter().map(markdown);
        std::iter::once(format!("# {}\n", self.title))
            .chain(blocks)
            .collect::<Vec<_>>()
            .join("\n")
    }

    /// As one HTML file.
    pub fn html(&self) -> String {
        let title = escaped(&self.title);
        let blocks: String = self.blocks.iter().map(html).collect();
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width\">\n<title>{title}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n{blocks}</body>\n</html>\n"
        )
    }
}

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;max-width:68em;margin:2em auto;padding:0 1em;color:#222}table{border-collapse:collapse;font-size:14px;display:block;overflow-x:auto}td,th{border:1px solid #ccc;padding:.3em .5em;text-align:left;vertical-align:top}th{background:#f3f3f3}figure{margin:2em 0}figure svg{max-width:100%;height:auto}figcaption{color:#444}code{background:#f3f3f3}.yes{background:#dcf0e4}.no{background:#f8dcd0}.open{background:#f4eed2}";

fn markdown(block: &Block) -> String {
    let row = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    match block {
        Block::Heading(text) => format!("## {text}\n"),
        Block::Text(text) => format!("{text}\n"),
        Block::List(items) => items.iter().map(|item| format!("- {item}\n")).collect(),
        Block::Table { head, rows } => {
            let line = "|---".repeat(head.len()) + "|\n";
            row(head) + &line + &rows.iter().map(|cells| row(cells)).collect::<String>()
        }
        Block::Picture { name, caption, .. } => {
            format!("![{name}]({name}.png)\n\n{}: {caption}\n", titled(name))
        }
    }
}

fn html(block: &Block) -> String {
    match block {
        Block::Heading(text) => format!("<h2>{}</h2>\n", inline(text)),
        Block::Text(text) => format!("<p>{}</p>\n", inline(text)),
        Block::List(items) => {
            let items: String = items
                .iter()
                .map(|item| format!("<li>{}</li>\n", inline(item)))
                .collect();
            format!("<ul>\n{items}</ul>\n")
        }
        Block::Table { head, rows } => {
            let head: String = head
                .iter()
                .map(|cell| format!("<th>{}</th>", inline(cell)))
                .collect();
            let row = |cells: &Vec<String>| {
                let cells: String = cells.iter().map(|cell| table_cell(cell)).collect();
                format!("<tr>{cells}</tr>\n")
            };
            let rows: String = rows.iter().map(row).collect();
            format!("<table>\n<tr>{head}</tr>\n{rows}</table>\n")
        }
        Block::Picture { name, caption, svg } => format!(
            "<figure id=\"{name}\">\n{svg}\n<figcaption><b>{}</b>: {}</figcaption>\n</figure>\n",
            titled(name),
            inline(caption)
        ),
    }
}

/// A cell, coloured by a verdict that it begins with.
fn table_cell(text: &str) -> String {
    let word = text.trim_start_matches("**").split([' ', '*']).next();
    match word {
        Some(word @ ("yes" | "no" | "open")) if text.len() < 30 => {
            format!("<td class=\"{word}\">{}</td>", inline(text))
        }
        _ => format!("<td>{}</td>", inline(text)),
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

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

/// Code and bold as HTML.
fn inline(text: &str) -> String {
    let paired = |text: String, mark: &str, tag: &str| {
        let parts = text.split(mark).enumerate();
        parts
            .map(|(k, part)| {
                if k % 2 == 1 {
                    format!("<{tag}>{part}</{tag}>")
                } else {
                    part.into()
                }
            })
            .collect::<String>()
    };
    paired(paired(escaped(text), "**", "b"), "`", "code")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn document() -> Document {
        let mut document = Document::new("A & B");
        document.text("see `x < y`");
        document.push(Block::Table {
            head: vec!["a".into(), "b".into()],
            rows: vec![vec!["**yes**".into(), "1".into()]],
        });
        document.push(Block::Picture {
            name: "figure-08".into(),
            caption: "a row".into(),
            svg: "<svg></svg>".into(),
        });
        document
    }

    #[test]
    fn markdown_names_its_pictures() {
        let text = document().markdown();
        assert!(
            text.contains("| a | b |\n|---|---|\n| **yes** | 1 |"),
            "{text}"
        );
        assert!(
            text.contains("![figure-08](figure-08.png)\n\nFigure 8: a row"),
            "{text}"
        );
    }

    #[test]
    fn html_holds_its_pictures_and_escapes_text() {
        let text = document().html();
        assert!(
            text.contains("<code>x &lt; y</code>") && text.contains("A &amp; B"),
            "{text}"
        );
        assert!(
            text.contains("<svg></svg>") && text.contains("<td class=\"yes\">"),
            "{text}"
        );
    }
}
