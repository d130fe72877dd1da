//! Standard output and standard error, escaped so that no name or message controls the terminal.
//!
//! If the reader leaves, later output is dropped and the work continues.

use std::borrow::Cow;
use std::io::{ErrorKind, Write};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use reception::bytes::{self, is_control};
use serde::Serialize;
use sim::accuracy::Level;
use sim::plan::Plan;
use studies::detectors::DetectorChoice;
use studies::monte_carlo;
use studies::statistics::share_95;
use studies::sweep::{Results, Summary};

use crate::numbers::two_decimals;

/// The outcome of a command without errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Exit status 0.
    Yes,
    /// Exit status 1.
    No,
}

/// Formats an error and its causes without repetition.
pub fn explain(error: &anyhow::Error) -> String {
    error
        .chain()
        .map(ToString::to_string)
        .fold(String::new(), |text, cause| match text.contains(&cause) {
            _ if text.is_empty() => cause,
            true => text,
            false => format!("{text}: {cause}"),
        })
}

/// Whether the reader of standard output has left.
static IS_UNREAD: AtomicBool = AtomicBool::new(false);

/// Whether the reader of standard output has left: endless work that saves nothing may then stop.
pub fn is_unread() -> bool {
    IS_UNREAD.load(Ordering::Relaxed)
}

/// Standard output.
pub struct Output;

/// The result of a write to a pipe; if its reader has left, calls `left` and returns `all`, so that the work continues.
pub fn unless_left<T>(written: std::io::Result<T>, all: T, left: impl FnOnce()) -> std::io::Result<T> {
    match written {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => {
            left();
            Ok(all)
        }
        written => written,
    }
}

fn until_unread<T>(all: T, write: impl FnOnce() -> std::io::Result<T>) -> std::io::Result<T> {
    match is_unread() {
        true => Ok(all),
        false => unless_left(write(), all, || IS_UNREAD.store(true, Ordering::Relaxed)),
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        until_unread(bytes.len(), || std::io::stdout().write(bytes))
    }

    fn flush(&mut self) -> std::io::Result<()> {
        until_unread((), || std::io::stdout().flush())
    }
}

/// Replaces some characters of a text.
fn replaced(text: &str, is_meant: impl Fn(char) -> bool, by: impl Fn(char) -> String) -> Cow<'_, str> {
    if !text.contains(&is_meant) {
        return text.into();
    }
    let each = text.chars().map(|c| if is_meant(c) { by(c) } else { c.into() });
    each.collect::<String>().into()
}

/// Escapes a text of several lines for a terminal.
fn shown(text: &str) -> Cow<'_, str> {
    replaced(
        text,
        |c| is_control(c) && !matches!(c, '\n' | '\t'),
        |c| c.escape_default().to_string(),
    )
}

/// Quotes bytes: text as a string literal, and `\xff` for bytes that are not UTF-8.
pub fn quoted(bytes: &[u8]) -> String {
    let mut quoted = String::from("\"");
    for chunk in bytes.utf8_chunks() {
        let valid = format!("{:?}", chunk.valid());
        quoted.push_str(&valid[1..valid.len() - 1]);
        quoted.push_str(&chunk.invalid().escape_ascii().to_string());
    }
    quoted + "\""
}

/// A file name on one line, with `\xff` for bytes that are not UTF-8.
pub fn name(path: &Path) -> String {
    let chunks = path.as_os_str().as_encoded_bytes().utf8_chunks();
    let chunks = chunks.map(|chunk| format!("{}{}", chunk.valid(), chunk.invalid().escape_ascii()));
    one_line(&chunks.collect::<String>()).into_owned()
}

/// Quotes a word for a shell, if it needs quotes.
pub fn shell_word(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_.,:/=+@".contains(c);
    match !word.is_empty() && word.chars().all(is_plain) {
        true => word.into(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    }
}

fn one_line(text: &str) -> Cow<'_, str> {
    replaced(text, is_control, |c| c.escape_default().to_string())
}

/// How JSON shows bytes that may be text.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct Hex {
    /// Add each message in hexadecimal digits to JSON (message_hex). Without it, only messages that are not UTF-8 have them.
    #[arg(long)]
    hex: bool,
}

impl Hex {
    /// A message's bytes as hexadecimal digits, if requested or if they are not text.
    pub fn of(self, message: &[u8]) -> Option<String> {
        match self.hex {
            true => Some(bytes::hex(message)),
            false => bytes::hex_if_no_text(message),
        }
    }
}

/// Prints to standard error, and ignores a closed stream.
pub fn tell(text: impl std::fmt::Display) {
    let _ = writeln!(std::io::stderr(), "{}", shown(&text.to_string()));
}

/// Prints one line.
pub fn line(text: &str) -> anyhow::Result<()> {
    Ok(writeln!(Output, "{}", one_line(text))?)
}

/// Prints a text of several lines.
pub fn lines(text: &str) -> anyhow::Result<()> {
    Ok(writeln!(Output, "{}", shown(text.trim_end()))?)
}

/// Prints one line of JSON, escaped for terminals.
pub fn json(value: &impl Serialize) -> anyhow::Result<()> {
    let text = serde_json::to_string(value)?;
    // Control characters occur only in its strings.
    let escaped = replaced(&text, is_control, |c| format!("\\u{:04x}", u32::from(c)));
    Ok(writeln!(Output, "{escaped}")?)
}

/// Prints the effects that a plan includes, and the influence of the others; [`crate::commands::plan`] prints more.
pub fn plan(plan: &Plan) -> anyhow::Result<()> {
    let included = plan.decisions.iter().filter(|decision| decision.included);
    let included: Vec<&str> = included.map(|decision| decision.effect).collect();
    line(&format!("effects: {}", included.join(", ")))?;
    line(&format!(
        "{} others left out: at most {:.4} grey levels before rounding (`vocc plan` says why)",
        plan.decisions.len() - included.len(),
        plan.left_out_grey()
    ))
}

/// Formats a bit error rate with its 95 % interval; without errors, the upper bounds.
pub fn rate(errors: u64, bits: u64, rate: f64, [low, high]: [f64; 2]) -> String {
    if errors > 0 || bits == 0 {
        return format!("{rate:.3e} (95 %: {low:.3e} to {high:.3e})");
    }
    let [_, alone] = share_95(0.0, bits as f64);
    format!("0 of {bits} bits: below {high:.1e} with 95 % if errors come by frames, {alone:.1e} if bits are independent")
}

#[derive(Serialize)]
struct EvaluationReport {
    #[serde(flatten)]
    summary: Summary,
    seconds: Option<f64>,
    seed: u64,
    level: Level,
    plan: Plan,
}

/// Prints an evaluation's results; `seconds`: its run time, if known.
pub fn evaluation(results: &Results, seconds: Option<f64>, as_json: bool) -> anyhow::Result<()> {
    let sweep = results.sweep();
    let view = monte_carlo::view(&sweep.scene, sweep.random_reflectance)?;
    let report = EvaluationReport {
        summary: results.summary(0),
        seconds,
        seed: sweep.seed,
        level: sweep.level,
        plan: Plan::of(&view),
    };
    if as_json {
        return json(&report);
    }
    plan(&report.plan)?;
    let found = &report.summary;
    match seconds {
        Some(seconds) => line(&format!("frames     {} in all, {seconds:.2} s of work", found.frames))?,
        None => line(&format!("frames     {}", found.frames))?,
    }
    line(&format!("seed       {}", sweep.seed))?;
    line(&format!("detector   {}", detector(found.detector)))?;
    if sweep.rare_events {
        line(&format!(
            "swarms     {} reached errors, worth {:.0} counted ones",
            found.bit_errors, found.effective_errors
        ))?;
    } else {
        line(&format!("Bvar       {}", two_decimals(found.bvar)))?;
        line(&format!("Wvar       {}", two_decimals(found.wvar)))?;
        line(&format!("B2W        {}", two_decimals(found.b2w)))?;
        line(&format!("bit errors {} of {}", found.bit_errors, found.bits))?;
        panel_errors(found)?;
    }
    let ber = if sweep.rare_events {
        rare_rate(found)
    } else {
        rate(found.bit_errors, found.bits, found.ber, found.ber_95)
    };
    line(&format!("BER        {ber}"))?;
    one_symbol(found)
}

/// The detector's name; for the paper's detector also that of receivers, because their errors differ.
fn detector(name: &str) -> String {
    match name.parse() {
        Ok(DetectorChoice::KMeans) => format!("{name}, the paper's; receivers use ml (--detector ml)"),
        _ => name.into(),
    }
}

/// Prints the rate without frames across a symbol change, if there are any: the one to compare detectors by.
fn one_symbol(found: &Summary) -> anyhow::Result<()> {
    let (Some(ber), Some(ber_95)) = (found.ber_one_symbol, found.ber_one_symbol_95) else {
        return Ok(());
    };
    let (Some(frames @ 1..), Some(wrong)) = (found.frames_across, found.bit_errors_across) else {
        return Ok(());
    };
    let (bits, bits_across) = (found.bits - 64 * frames, 64 * frames);
    line(&format!(
        "across     {frames} frames are exposed across a change of symbols: {wrong} of their {bits_across} bits are wrong"
    ))?;
    let elsewhere = rate(found.bit_errors - wrong, bits, ber, ber_95);
    line(&format!("elsewhere  BER {elsewhere}"))
}

/// Formats a rate found by swarms, with its 95 % interval; unknown if no swarm reached an error.
fn rare_rate(found: &Summary) -> String {
    if found.bit_errors > 0 {
        let [low, high] = found.ber_95;
        return format!("{:.3e} (95 %: {low:.3e} to {high:.3e})", found.ber);
    }
    format!("unknown: no swarm reached an error in {} frames; give more --frames", found.frames)
}

/// Prints the panels with errors, and what a genie's rate bounds.
fn panel_errors(found: &Summary) -> anyhow::Result<()> {
    let (Some(wrong), Some([low, high])) = (found.panel_errors, found.panel_error_rate_95) else {
        return Ok(());
    };
    line(&format!(
        "panels     {wrong} of {} with errors (95 %: {low:.3e} to {high:.3e})",
        found.frames
    ))?;
    if found.detector == DetectorChoice::Genie.name() {
        line(
            "bound      of panels with errors: no receiver is expected to have fewer, nor a BER below a 64th of their share. Of bit errors \
             it is none",
        )?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_text_moves_a_cursor() {
        let hostile = "a\u{1b}[2J\u{7f}\u{9b}\u{202e}\u{2066}\u{2028}\nb";
        assert_eq!(one_line(hostile), r"a\u{1b}[2J\u{7f}\u{9b}\u{202e}\u{2066}\u{2028}\nb");
        assert_eq!(shown(hostile), "a\\u{1b}[2J\\u{7f}\\u{9b}\\u{202e}\\u{2066}\\u{2028}\nb");
        assert_eq!(one_line("größer als 2 µm²"), "größer als 2 µm²");
    }

    #[test]
    fn words_are_quoted_for_a_shell_if_they_need_it() {
        assert_eq!(shell_word("--set=camera.readout_s=0.01"), "--set=camera.readout_s=0.01");
        for word in ["", "it's", "[1, 2]", "$HOME", "a;b"] {
            let echoed = std::process::Command::new("sh")
                .args(["-c", &format!("printf %s {}", shell_word(word))])
                .output()
                .expect("a shell");
            assert_eq!(echoed.stdout, word.as_bytes());
        }
    }

    #[test]
    fn bytes_in_quotes_can_be_told_apart() {
        assert_eq!(quoted("Glatteis \"Brücke\"\n".as_bytes()), r#""Glatteis \"Brücke\"\n""#);
        let [one, other, spelt] = [&b"\xff\x01"[..], b"\xfe\x01", br"\xff\u{1}"].map(quoted);
        assert_eq!((&one[..], &other[..]), (r#""\xff\u{1}""#, r#""\xfe\u{1}""#));
        assert_ne!(one, spelt);
    }

    #[cfg(unix)]
    #[test]
    fn names_of_any_bytes_are_shown() {
        use std::os::unix::ffi::OsStrExt;
        let path = Path::new(std::ffi::OsStr::from_bytes(b"b\xff\n.png"));
        assert_eq!(name(path), r"b\xff\n.png");
    }

    #[test]
    fn no_error_is_told_by_what_it_says() {
        let none = rate(0, 6_400_000, 0.0, [0.0, 3.0e-5]);
        assert!(none.starts_with("0 of 6400000 bits: below 3.0e-5"), "{none}");
        assert!(none.contains("5.8e-7 if bits are independent"), "{none}");
        assert_eq!(rate(2, 200, 0.01, [0.002, 0.03]), "1.000e-2 (95 %: 2.000e-3 to 3.000e-2)");
        assert!(rate(0, 0, 0.0, [0.0, 1.0]).contains("1.000e0"));
    }
}
