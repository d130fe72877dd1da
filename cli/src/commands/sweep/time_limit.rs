//! Time limits in the format of `sbatch`.

use std::str::FromStr;

/// Time limit of a task.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TimeLimit {
    /// The original text.
    pub text: String,
    /// In seconds; `None` if unlimited.
    pub seconds: Option<u64>,
}

impl FromStr for TimeLimit {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let unlimited = ["0", "UNLIMITED", "INFINITE"].contains(&text);
        let seconds = if unlimited { None } else { Some(parse(text)) };
        match seconds {
            Some(None) => Err("give minutes, hours:minutes:seconds, days-hours or days-hours:minutes:seconds"),
            known => Ok(Self {
                text: text.into(),
                seconds: known.flatten(),
            }),
        }
    }
}

fn parse(text: &str) -> Option<u64> {
    let number = |text: &str| {
        let is_short = (1..=9).contains(&text.len());
        let is_plain = is_short && text.bytes().all(|byte| byte.is_ascii_digit());
        is_plain.then(|| text.parse::<u64>().ok()).flatten()
    };
    let (days, rest) = match text.split_once('-') {
        Some((days, rest)) => (Some(number(days)?), rest),
        None => (None, text),
    };
    let parts: Vec<u64> = rest.split(':').map(number).collect::<Option<_>>()?;
    let (hours, minutes, seconds) = match (days, parts.as_slice()) {
        (Some(_), &[hours]) => (hours, 0, 0),
        (Some(_), &[hours, minutes]) => (hours, minutes, 0),
        (None, &[minutes]) => (0, minutes, 0),
        (None, &[minutes, seconds]) => (0, minutes, seconds),
        (_, &[hours, minutes, seconds]) => (hours, minutes, seconds),
        _ => return None,
    };
    Some(((days.unwrap_or(0) * 24 + hours) * 60 + minutes) * 60 + seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_read_as_sbatch_does() {
        let seconds = |text: &str| text.parse::<TimeLimit>().map(|limit| limit.seconds);
        for (text, expected) in [
            ("90", 5400),
            ("2:30", 150),
            ("01:00:00", 3600),
            ("1-12", 129_600),
            ("1-0:30", 88_200),
            ("2-0:0:1", 172_801),
        ] {
            assert_eq!(seconds(text), Ok(Some(expected)), "{text}");
        }
        assert_eq!(seconds("UNLIMITED"), Ok(None));
        for text in ["", "1h", "-1", "1-", "1:2:3:4", "1-2:3:4:5", "1 2", "+5", "9999999999"] {
            assert!(seconds(text).is_err(), "{text}");
        }
    }
}
