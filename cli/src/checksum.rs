//! JSON with a checksum that detects later changes.

use anyhow::ensure;
use serde::Serialize;
use serde::de::DeserializeOwned;
use studies::checksum;

/// The text before and after the checksum, the object's last field.
const AROUND: [&str; 2] = [",\"checksum\":\"", "\"}"];

/// Serialises an object, with the checksum of its text without this field.
pub fn to_json(value: &impl Serialize) -> serde_json::Result<String> {
    let text = serde_json::to_string(value)?;
    let [before, after] = AROUND;
    let open = text.strip_suffix('}').unwrap_or(&text);
    Ok(format!("{open}{before}{}{after}", checksum::of(text.as_bytes())))
}

/// Parses and verifies a text. A text without a checksum is from an earlier version.
pub fn from_json<T: DeserializeOwned>(text: &str) -> anyhow::Result<T> {
    let [before, after] = AROUND;
    let parts = text.trim_end().strip_suffix(after).and_then(|text| text.rsplit_once(before));
    let Some((open, found)) = parts else {
        return Ok(serde_json::from_str(text)?);
    };
    let whole = format!("{open}}}");
    let wanted = checksum::of(whole.as_bytes());
    ensure!(
        found == wanted,
        "it was changed after it was written: its checksum should be {wanted}"
    );
    Ok(serde_json::from_str(&whole)?)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    #[test]
    fn a_change_is_noticed_wherever_it_is() {
        let kept = BTreeMap::from([("errors", 256), ("frames", 60_000)]);
        let text = to_json(&kept).expect("JSON");
        let read = |text: &str| from_json::<BTreeMap<String, u64>>(text);
        assert_eq!(read(&text).expect("unchanged")["errors"], 256);
        for place in 0..text.len() {
            let mut changed = text.clone().into_bytes();
            changed[place] ^= 1;
            let changed = String::from_utf8(changed).expect("text");
            assert!(read(&changed).is_err(), "{changed}");
            assert!(read(&text[..place]).is_err(), "{}", &text[..place]);
        }
        assert_eq!(read(r#"{"errors":1}"#).expect("an earlier version's")["errors"], 1);
    }
}
