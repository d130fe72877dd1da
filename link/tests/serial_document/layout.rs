//! The layout of the messages, from their types and from the document: both must have the same words line by line.

use std::slice::SliceIndex;

use link::serial::{Answer, Counters, Faults, Light, Limit, Measured, Refusal, Request, SensorReading};
use postcard_schema::Schema;
use postcard_schema::schema::{DataModelType as Type, DataModelVariant as Variant, NamedType, NamedValue, NamedVariant};
use pulldown_cmark::{Event, Parser, Tag, TagEnd};

/// The number of messages that every program of this version knows, from 0 on. Others were added later.
const REQUESTS: usize = 12;
const ANSWERS: usize = 8;
const REFUSALS: usize = 11;

/// The layout from the types: each message that every program knows, then the parts of messages.
pub fn by_the_types() -> Vec<String> {
    [
        message::<Request<'_>>("request", ..REQUESTS),
        message::<Answer<'_>>("answer", ..ANSWERS),
        message::<Refusal>("refusal", ..REFUSALS),
        vec![
            format!("light: {}", choices::<Light>()),
            format!("limit: {}", choices::<Limit>()),
            format!("faults: {}", faults()),
            format!("counters: {}", counters()),
            format!("calibration: {}", fields(members(Measured::SCHEMA))),
        ],
    ]
    .concat()
}

/// The layout of the later messages, from the types.
pub fn added_by_the_types() -> Vec<String> {
    [
        message::<Request<'_>>("request", REQUESTS..),
        message::<Answer<'_>>("answer", ANSWERS..),
        message::<Refusal>("refusal", REFUSALS..),
        vec![format!("sensor reading: {}", choices::<SensorReading>())],
    ]
    .concat()
}

/// The texts of the layout in the document: the messages that every program knows, and the later ones.
pub fn shown(document: &str) -> [&str; 2] {
    let blocks = Parser::new(document).into_offset_iter();
    let texts = blocks.scan(false, |inside, (event, at)| {
        match event {
            Event::Start(Tag::CodeBlock(_)) => *inside = true,
            Event::End(TagEnd::CodeBlock) => *inside = false,
            Event::Text(_) if *inside => return Some(Some(&document[at])),
            _ => {}
        }
        Some(None)
    });
    let layouts: Vec<&str> = texts.flatten().filter(|text| text.contains("\nrequest\n")).collect();
    layouts
        .try_into()
        .expect("docs/serial.md shows the messages, and those that were added")
}

/// The lines of a shown layout from the first message on, without notes, units and line breaks within a message.
pub fn words(shown: &str) -> Vec<String> {
    let start = shown.find("request\n").expect("the first message");
    let mut lines: Vec<String> = Vec::new();
    for line in shown[start..].lines().filter(|line| !line.is_empty()) {
        match lines.last_mut().filter(|_| line.starts_with("          ")) {
            Some(before) => *before += line,
            None => lines.push(line.to_owned()),
        }
    }
    let lines = lines.iter().map(|line| plain(line));
    lines.collect()
}

fn plain(line: &str) -> String {
    let mut parts = line.split(" (");
    let mut kept = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        kept += part.split_once(')').expect("notes end").1;
    }
    if kept.starts_with(' ') {
        // The explanation of a value.
        kept.truncate(kept.find(": ").unwrap_or(kept.len()));
    }
    let words: Vec<&str> = kept.split_whitespace().collect();
    words.join(" ").to_lowercase().replace('-', " ")
}

fn message<T: Schema>(name: &str, numbers: impl SliceIndex<[usize], Output = [usize]>) -> Vec<String> {
    let all = cases(T::SCHEMA);
    let every: Vec<usize> = (0..all.len()).collect();
    let cases = every[numbers].iter().map(|&number| {
        let case = all[number];
        let body = match case.ty {
            Variant::UnitVariant => String::new(),
            Variant::NewtypeVariant(inner) => match inner.ty {
                Type::Struct(members) if *inner != Measured::SCHEMA => fields(members),
                _ => type_word(inner),
            },
            Variant::StructVariant(members) => fields(members),
            Variant::TupleVariant(_) => panic!("{} has fields without names", case.name),
        };
        format!("{number} {} {body}", spaced(case.name)).trim_end().to_owned()
    });
    [name.to_owned()].into_iter().chain(cases).collect()
}

fn choices<T: Schema>() -> String {
    let cases = cases(T::SCHEMA).iter().enumerate();
    let words: Vec<String> = cases
        .map(|(number, case)| match case.ty {
            Variant::NewtypeVariant(inner) => format!("{number} {} {}", spaced(case.name), type_word(inner)),
            _ => format!("{number} {}", spaced(case.name)),
        })
        .collect();
    words.join(", ")
}

fn faults() -> String {
    let names = Faults::all().iter_names();
    let words: Vec<String> = names
        .enumerate()
        .map(|(bit, (name, fault))| {
            assert_eq!(fault.bits(), 1 << bit);
            format!("{bit} {}", name.to_lowercase().replace('_', " "))
        })
        .collect();
    format!("bit {}", words.join(", "))
}

fn counters() -> String {
    let members = members(Counters::SCHEMA);
    assert!(members.iter().all(|member| *member.ty.ty == Type::U32));
    let names: Vec<&str> = members.iter().map(|member| member.name).collect();
    format!("{}, u32 each", names.join(", "))
}

fn fields(members: &[&NamedValue]) -> String {
    let words: Vec<String> = members.iter().map(|member| field(member)).collect();
    words.join(", ")
}

/// Name and type, or one word if they are equal. A unit that the document gives in a note is not part of the name.
fn field(member: &NamedValue) -> String {
    let name = member.name.trim_end_matches("_cd_m2");
    let (name, kind) = (name.trim_end_matches("_lx"), type_word(member.ty));
    if name == kind { kind } else { format!("{name} {kind}") }
}

fn type_word(of: &NamedType) -> String {
    match of.ty {
        Type::Bool => "bool".to_owned(),
        Type::U8 => "u8".to_owned(),
        Type::U16 => "u16".to_owned(),
        Type::U32 => "u32".to_owned(),
        Type::U64 => "u64".to_owned(),
        Type::String => "text".to_owned(),
        Type::Seq(inner) if *inner.ty == Type::U8 => "bytes".to_owned(),
        Type::Option(inner) => format!("option {}", type_word(inner)),
        Type::NewtypeStruct(inner) => type_word(inner),
        Type::Struct(_) if of == Measured::SCHEMA => "calibration".to_owned(),
        Type::Struct(_) | Type::Enum(_) => spaced(of.name),
        other => panic!("the document has no word for {other:?}"),
    }
}

fn cases(of: &NamedType) -> &'static [&'static NamedVariant] {
    match of.ty {
        Type::Enum(cases) => cases,
        other => panic!("{} is {other:?}", of.name),
    }
}

fn members(of: &NamedType) -> &'static [&'static NamedValue] {
    match of.ty {
        Type::Struct(members) => members,
        other => panic!("{} is {other:?}", of.name),
    }
}

/// `ReadTable`: read table.
fn spaced(name: &str) -> String {
    let mut words = String::new();
    for letter in name.chars() {
        if letter.is_uppercase() && !words.is_empty() {
            words.push(' ');
        }
        words.extend(letter.to_lowercase());
    }
    words
}
