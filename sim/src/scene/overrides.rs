//! Overrides of single keys of a scene: `TABLE.KEY=VALUE`.

use toml::{Table, Value};

use super::error::SceneError;
use crate::keys;

/// The value of a key that is left out.
const NONE: &str = "none";

/// Applies one `TABLE.KEY=VALUE` to the scene's table; `none` leaves the key out.
pub(crate) fn overrule(table: &mut Table, text: &str) -> Result<(), SceneError> {
    let fault = |why: &str| SceneError::Override {
        text: text.into(),
        why: why.into(),
    };
    // A second line would be a second key, which TOML accepts silently.
    if text.chars().any(|c| c.is_control() && c != '\t') {
        return Err(fault("it is more than one line"));
    }
    let (path, value) = text.split_once('=').ok_or_else(|| fault("there is no '='"))?;
    let keys: Vec<&str> = path.trim().split('.').collect();
    let (last, tables) = keys
        .split_last()
        .filter(|(_, tables)| !tables.is_empty())
        .ok_or_else(|| fault("the key names no table"))?;
    let mut place = table;
    for key in tables {
        let empty = if *key == "panel" {
            Value::Array(vec![Value::Table(Table::new())])
        } else {
            Value::Table(Table::new())
        };
        place = match place.entry(*key).or_insert(empty) {
            Value::Table(inner) => inner,
            Value::Array(panels) => panels
                .first_mut()
                .and_then(Value::as_table_mut)
                .ok_or_else(|| fault("there is no first panel"))?,
            _ => return Err(fault("a value stands where a table should")),
        };
    }
    // An unknown key is an error of the scene.
    let is_known = tables.last().is_some_and(|table| keys::find(table, last).is_some());
    match value.trim() {
        NONE if is_known => drop(place.remove(*last)),
        value => drop(place.insert((*last).to_string(), parse_value(value))),
    }
    Ok(())
}

/// A TOML value; a bare word is a string, so that no quotes are needed in a shell.
pub fn parse_value(text: &str) -> Value {
    let as_toml = toml::from_str::<Table>(&format!("value = {text}"))
        .ok()
        .filter(|table| table.len() == 1)
        .and_then(|mut table| table.remove("value"));
    match as_toml {
        Some(Value::Integer(n)) if n.unsigned_abs() > 1 << 53 => Value::Float(n as f64),
        Some(value) => value,
        None => Value::String(text.to_string()),
    }
}
