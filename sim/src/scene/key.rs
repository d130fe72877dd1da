//! Expands a line of the scene's [tables](super::tables) to a field with its default, a range check, and an entry of the list.

use std::ops::RangeInclusive;

use toml::Value;

/// A table of scene files.
pub(crate) struct Table {
    /// Its header in a file.
    pub(super) header: &'static str,
    /// The comment after the header.
    pub(super) remark: &'static str,
    /// Its keys, in the order in which presets write them.
    pub(crate) keys: &'static [Key],
}

impl Table {
    /// Its name.
    pub(crate) fn name(&self) -> &'static str {
        self.header.trim_matches(['[', ']'])
    }
}

/// A key of scene files.
pub struct Key {
    /// Its name within its table.
    pub name: &'static str,
    /// The unit of its numbers; empty if they have none.
    pub unit: &'static str,
    pub(super) range: Option<fn() -> RangeInclusive<f64>>,
    pub(super) default: fn() -> Option<Value>,
    pub(super) example: Option<&'static str>,
    pub(super) note: Option<&'static str>,
}

impl Key {
    /// The range of its numbers, if it has one; if other keys limit it, with their defaults.
    pub fn range(&self) -> Option<RangeInclusive<f64>> {
        self.range.map(|range| range())
    }

    /// Its line in a preset that does not set it, with a default or an example; `None` if it has neither.
    pub(crate) fn line(&self) -> Option<String> {
        let set = match ((self.default)(), self.example) {
            (Some(default), _) => format!("{} = {}", self.name, plain(&default)),
            (None, Some(example)) => format!("# {} = {example}", self.name),
            (None, None) => return None,
        };
        Some(with_remark(set, self.note.unwrap_or_default()))
    }

    /// Whether its line sets nothing.
    pub(super) fn is_unset(&self) -> bool {
        (self.default)().is_none()
    }
}

/// A line of a preset with a comment, unless that is empty.
pub(super) fn with_remark(line: impl std::fmt::Display, remark: &str) -> String {
    match remark {
        "" => line.to_string(),
        remark => format!("{:<29}# {remark}", line.to_string()),
    }
}

/// A value in the notation of a user: integers without a point.
fn plain(value: &Value) -> String {
    match value {
        Value::Float(number) => number.to_string(),
        Value::Array(parts) => format!("[{}]", parts.iter().map(plain).collect::<Vec<_>>().join(", ")),
        other => other.to_string(),
    }
}

/// Expands the lines of a table to its struct, with defaults, the check of its ranges and the list of its keys.
///
/// A line is `/// words`, then `key: type = default`, then optionally `in range` (which may name the table's other keys through the word
/// behind `as`), `unit "…"`, `such as "…"` (an example, if the default is none) and `# "…"` (the comment after it in presets). `with`
/// introduces the fields that are not keys themselves.
macro_rules! table {
    (
        $(#[$about:meta])*
        $header:literal $(# $remark:literal)? $Table:ident as $this:ident {
            $(
                $(#[$words:meta])*
                $key:ident: $type:ty = $default:expr
                    $(, in $range:expr)?
                    $(, unit $unit:literal)?
                    $(, such as $example:literal)?
                    $(, # $note:literal)?;
            )*
        }
        $(with {$(
            $(#[$other_words:meta])*
            $other:ident: $other_type:ty = $other_default:expr;
        )*})?
    ) => {
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        $(#[$about])*
        pub struct $Table {
            $(
                $(#[$words])*
                $(#[doc = concat!("In ", $unit, ".")])?
                $(#[doc = concat!("`", stringify!($range), "`")])?
                $(
                    #[doc = concat!("For instance ", $example, ".")]
                    #[serde(skip_serializing_if = "Option::is_none")]
                )?
                pub $key: $type,
            )*
            $($($(#[$other_words])* pub $other: $other_type,)*)?
        }

        impl Default for $Table {
            fn default() -> Self {
                Self {
                    $($key: $default,)*
                    $($($other: $other_default,)*)?
                }
            }
        }

        impl $Table {
            pub(super) const TABLE: Table = Table {
                header: $header,
                remark: [$($remark,)? ""][0],
                keys: &[$(Key {
                    name: stringify!($key),
                    unit: [$($unit,)? ""][0],
                    range: [
                        $(Some({
                            #[allow(unused_variables, reason = "few ranges name another key")]
                            fn range() -> RangeInclusive<f64> {
                                let $this = $Table::default();
                                $range
                            }
                            range as fn() -> RangeInclusive<f64>
                        }),)?
                        None,
                    ][0],
                    default: || {
                        let default: $type = $default;
                        toml::Value::try_from(default).ok()
                    },
                    example: [$(Some($example),)? None][0],
                    note: [$(Some($note),)? None][0],
                }),*],
            };

            /// Checks that each key is within its range; `name` gives a key's name for errors.
            #[allow(unused_variables, reason = "few ranges name another key")]
            pub(super) fn check(&self, name: impl Fn(&str) -> String) -> Result<(), RangeError> {
                let $this = self;
                $($(Ranged::check(&self.$key, $range, &|| name(stringify!($key)))?;)?)*
                Ok(())
            }
        }
    };
}

pub(super) use table;
