//! The subset of YAML in calibrations: scalars, lists and mappings.

use anyhow::{Context, bail, ensure};
use granit_parser::{Event, Parser, ScalarStyle, ScanError};

/// A value.
#[derive(Debug, PartialEq)]
pub enum Yaml {
    /// Empty, or `null`.
    Null,
    Scalar(String),
    List(Vec<Self>),
    Mapping(Vec<(Self, Self)>),
    /// A reference to an anchor. It is not resolved.
    Alias,
}

type Events<'a> = dyn Iterator<Item = Result<Event<'a>, ScanError>> + 'a;

fn next<'a>(events: &mut Events<'a>) -> anyhow::Result<Event<'a>> {
    Ok(events.next().context("it ends too early")??)
}

impl Yaml {
    /// Parses a text of one document.
    pub fn read(text: &str) -> anyhow::Result<Self> {
        let mut value = None;
        let events: &mut Events = &mut Parser::new_from_str(text).map(|event| event.map(|(event, _)| event));
        while let Some(event) = events.next().transpose()? {
            match event {
                Event::StreamStart | Event::StreamEnd | Event::DocumentEnd => {}
                Event::DocumentStart(..) if value.is_none() => {
                    value = Some(Self::node(next(events)?, events)?);
                }
                _ => bail!("it has more than one document"),
            }
        }
        value.context("it is empty")
    }

    /// Parses the value that begins with `event`. The parser limits the nesting depth.
    fn node<'a>(event: Event<'a>, events: &mut Events<'a>) -> anyhow::Result<Self> {
        Ok(match event {
            Event::Scalar(text, ScalarStyle::Plain, ..) if matches!(&text[..], "" | "~" | "null" | "Null" | "NULL") => Self::Null,
            Event::Scalar(text, ..) => Self::Scalar(text.into_owned()),
            Event::SequenceStart(..) => {
                let mut list = Vec::new();
                loop {
                    match next(events)? {
                        Event::SequenceEnd => break Self::List(list),
                        event => list.push(Self::node(event, events)?),
                    }
                }
            }
            Event::MappingStart(..) => {
                let mut mapping = Vec::new();
                loop {
                    match next(events)? {
                        Event::MappingEnd => break Self::Mapping(mapping),
                        event => {
                            let key = Self::node(event, events)?;
                            mapping.push((key, Self::node(next(events)?, events)?));
                        }
                    }
                }
            }
            _ => Self::Alias,
        })
    }

    /// The value of a key, unless it is null.
    pub fn get(&self, key: &str) -> anyhow::Result<Option<&Self>> {
        let Self::Mapping(mapping) = self else {
            bail!("it has no keys");
        };
        let mut values = mapping.iter().filter(|(name, _)| matches!(name, Self::Scalar(name) if name == key));
        let value = values.next().map(|(_, value)| value);
        ensure!(values.next().is_none(), "{key} is given twice");
        Ok(value.filter(|value| **value != Self::Null))
    }

    pub fn text(&self) -> anyhow::Result<String> {
        match self {
            Self::Scalar(text) => Ok(text.clone()),
            Self::Alias => bail!("it refers to another value: write the value itself"),
            _ => bail!("it is not a single value"),
        }
    }

    pub fn count(&self) -> anyhow::Result<usize> {
        let text = self.text()?;
        text.trim().parse().with_context(|| format!("{text:?} is not a whole number"))
    }

    pub fn numbers(&self) -> anyhow::Result<Vec<f64>> {
        let Self::List(list) = self else {
            bail!("it is not a list of numbers");
        };
        let number = |value: &Self| {
            let text = value.text()?;
            float(text.trim()).with_context(|| format!("{text:?} is not a number"))
        };
        list.iter().map(number).collect()
    }
}

/// Parses a number of YAML 1.2, section 10.2.1.4.
fn float(text: &str) -> Option<f64> {
    match text.to_ascii_lowercase().as_str() {
        ".nan" => Some(f64::NAN),
        ".inf" | "+.inf" => Some(f64::INFINITY),
        "-.inf" => Some(f64::NEG_INFINITY),
        // In YAML, `nan` and `inf` without the dot are text.
        _ => text.parse().ok().filter(|number: &f64| number.is_finite()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;

    #[test]
    fn values_stand_in_lists_and_under_keys() {
        let text =
            "# by hand\n---\nplain: 1\n'quoted': \"a: b\"\nnothing:\ntilde: ~\nnested: {data: [1., .5, 2e3]}\nlist:\n- 1\n- -0.25\n...\n";
        let yaml = Yaml::read(text).unwrap();
        let get = |key| yaml.get(key).unwrap();
        assert_eq!(get("plain").unwrap().count().unwrap(), 1);
        assert_eq!(get("quoted").unwrap().text().unwrap(), "a: b");
        assert_eq!([get("nothing"), get("tilde"), get("missing")], [None; 3]);
        let data = get("nested").unwrap().get("data").unwrap().unwrap();
        assert_eq!(data.numbers().unwrap(), [1.0, 0.5, 2000.0]);
        assert_eq!(get("list").unwrap().numbers().unwrap(), [1.0, -0.25]);
    }

    #[test]
    fn numbers_that_are_not_finite_are_written_with_a_dot() {
        let yaml = Yaml::read("a: [.inf, -.Inf, .NaN]\n").unwrap();
        let numbers = yaml.get("a").unwrap().unwrap().numbers().unwrap();
        assert_eq!(numbers[..2], [f64::INFINITY, f64::NEG_INFINITY]);
        assert!(numbers[2].is_nan());
    }

    #[test]
    fn what_is_none_of_these_is_refused() {
        for (text, wrong) in [
            ("", "it is empty"),
            ("a: 1\n---\na: 2\n", "more than one document"),
            ("a: [1, 2", "line 1"),
            ("- 1\n", "it has no keys"),
            ("a: 1\na: 2\n", "a is given twice"),
            ("b: &b [1]\na: *b\n", "it is not a list"),
            ("a: [1, inf]\n", "\"inf\" is not a number"),
            ("b: &b 1\na: [1, *b]\n", "refers to another value"),
        ] {
            let numbers = Yaml::read(text).and_then(|yaml| yaml.get("a")?.context("nothing")?.numbers());
            let error = format!("{:#}", numbers.unwrap_err());
            assert!(error.contains(wrong), "{text:?}: {error}");
        }
    }

    properties! {
        #[test]
        fn no_text_makes_it_panic(text in "[ -~\n]{0,200}|[a: {}\\[\\]&*,?|>\n-]{0,200}") {
            let _ = Yaml::read(&text);
        }
    }
}
