//! Lines of text on the port: events, for a person at a terminal.

use core::fmt::Write;

use super::Port;
use super::message::Fault;
use link::signing::Verdict;

/// The state that was last printed.
#[derive(Default)]
pub struct PrintedState {
    is_following: Option<bool>,
    fault: Option<Fault>,
}

impl PrintedState {
    /// Prints changes.
    pub fn update(&mut self, is_following: bool, fault: Option<Fault>, port: &mut impl Port) {
        let mut text = Text(port);
        if self.fault != fault {
            let _ = match fault {
                Some(fault) => write!(text, "fault: {fault}\r\n"),
                None => text.write_str("fault: none any more\r\n"),
            };
        }
        if self.is_following != Some(is_following) {
            let state = if is_following { "following" } else { "searching" };
            let _ = write!(text, "state: {state}\r\n");
        }
        (self.is_following, self.fault) = (Some(is_following), fault);
    }
}

/// Text without zeros, because these delimit answers.
struct Text<'a, P>(&'a mut P);

impl<P: Port> Write for Text<'_, P> {
    fn write_str(&mut self, text: &str) -> core::fmt::Result {
        self.0.write(text.as_bytes());
        Ok(())
    }
}

/// Prints who has signed the last message.
pub fn write_verdict(verdict: &Verdict, port: &mut impl Port) {
    let _ = write!(Text(port), "verdict: {verdict}\r\n");
}

/// Prints a message in one line, whatever its bytes.
pub fn write_message(message: &[u8], port: &mut impl Port) {
    let mut text = Text(port);
    let _ = text.write_str("message: ");
    for chunk in message.utf8_chunks() {
        for character in chunk.valid().chars() {
            let _ = if character.is_control() {
                write!(text, "{}", character.escape_default())
            } else {
                text.write_char(character)
            };
        }
        for byte in chunk.invalid() {
            let _ = write!(text, "\\x{byte:02x}");
        }
    }
    let _ = text.write_str("\r\n");
}
