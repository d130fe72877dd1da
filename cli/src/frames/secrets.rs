//! Passwords in addresses and options, which no output may show.

use std::ops::Range;

/// The replacement of a password.
pub const HIDDEN: &str = "***";
/// Ends of the names of parameters and options that hold a password or a key.
const NAMES: [&str; 7] = ["password", "passwd", "pass", "pwd", "passphrase", "token", "key"];
/// Ends of a parameter's value.
const ENDS: [char; 3] = ['&', ';', '#'];
/// A shorter password is hidden only in its place in an address, because it may be part of any word.
const LENGTH_MIN: usize = 4;

/// The address with its passwords hidden: `rtsp://user:***@host/live`.
pub fn masked(address: &str) -> String {
    let mut masked = String::new();
    let mut shown = 0;
    for Range { start, end } in places(address) {
        masked += &address[shown..start];
        masked += HIDDEN;
        shown = end;
    }
    masked + &address[shown..]
}

/// The places of the passwords in an address, in order.
fn places(address: &str) -> Vec<Range<usize>> {
    let Some(scheme) = address.find("://") else {
        return Vec::new();
    };
    let host = scheme + 3;
    let login = login(&address[host..]);
    let mut places: Vec<_> = login.iter().map(|place| host + place.start..host + place.end).collect();
    let mut next = places.last().map_or(host, |place| place.end);
    while let Some(length) = address[next..].find('=') {
        let (name, value) = (&address[next..next + length], next + length + 1);
        next = value;
        if is_secret(name) {
            next = address[value..].find(ENDS).map_or(address.len(), |length| value + length);
            places.push(value..next);
        }
    }
    places.retain(|place| !place.is_empty());
    places
}

/// The place of the password in `user:password@host/path`.
fn login(address: &str) -> Option<Range<usize>> {
    let end = address.find(['/', '?', '#']).unwrap_or(address.len());
    let (user, port) = address[..end].split_once(':')?;
    let start = user.len() + 1;
    // A password with an unescaped slash leaves no host before it, and no port.
    let is_cut = !address[..end].contains(['@', '[']) && !port.bytes().all(|byte| byte.is_ascii_digit());
    let at = if is_cut { address.rfind('@') } else { address[..end].rfind('@') };
    at.filter(|&at| at >= start).map(|at| start..at)
}

/// Whether a parameter of this name holds a password.
fn is_secret(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    NAMES.iter().any(|end| name.ends_with(end))
}

/// The passwords of a source, to be hidden in the texts of other programs.
#[derive(Clone, Debug, Default)]
pub struct Secrets {
    /// An address, and its masked form.
    address: Option<(String, String)>,
    passwords: Vec<String>,
}

impl Secrets {
    /// The passwords in an address and in ffmpeg's options.
    pub fn of(address: Option<&str>, options: &str) -> Self {
        let words: Vec<&str> = options.split_whitespace().collect();
        let given = words.windows(2).filter(|pair| pair[0].starts_with('-') && is_secret(pair[0]));
        let given = given.map(|pair| pair[1]);
        let held = address
            .into_iter()
            .flat_map(|address| places(address).into_iter().map(|place| &address[place]));
        // Programs print addresses with and without percent escapes.
        let mut passwords: Vec<String> = given
            .chain(held)
            .flat_map(|password| [password.to_owned(), unescaped(password)])
            .collect();
        // A password may begin with another one.
        passwords.sort_by_key(|password| std::cmp::Reverse(password.len()));
        passwords.dedup();
        Self {
            address: address.map(|address| (address.to_owned(), masked(address))),
            passwords,
        }
    }

    /// The text with all passwords hidden.
    pub fn hide(&self, text: &str) -> String {
        let mut text = match &self.address {
            Some((address, masked)) => text.replace(address, masked),
            None => text.to_owned(),
        };
        for password in &self.passwords {
            text = match password.len() < LENGTH_MIN {
                true if text == *password => HIDDEN.into(),
                true => text
                    .replace(&format!(":{password}@"), &format!(":{HIDDEN}@"))
                    .replace(&format!("={password}"), &format!("={HIDDEN}")),
                false => text.replace(password, HIDDEN),
            };
        }
        text
    }
}

/// The text with its percent escapes decoded.
fn unescaped(text: &str) -> String {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let [first, after @ ..] = rest {
        let escaped = match (first, after) {
            (b'%', [high, low, ..]) => std::str::from_utf8(&[*high, *low])
                .ok()
                .and_then(|hex| u8::from_str_radix(hex, 16).ok()),
            _ => None,
        };
        bytes.push(escaped.unwrap_or(*first));
        rest = if escaped.is_some() { &after[2..] } else { after };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;

    #[test]
    fn an_address_is_shown_without_its_passwords() {
        for (address, shown) in [
            ("rtsp://me:secret@cam/live?a=@:", "rtsp://me:***@cam/live?a=@:"),
            ("rtsp://me:sec:r@et@cam", "rtsp://me:***@cam"),
            ("rtsp://me:it's@cam/live", "rtsp://me:***@cam/live"),
            ("rtsp://me:se/cr?et#1@cam:554/live", "rtsp://me:***@cam:554/live"),
            ("rtsp://:secret@cam/live", "rtsp://:***@cam/live"),
            ("ftp://me:secret@host/film.mp4", "ftp://me:***@host/film.mp4"),
            (
                "http://cam/video?user=me&Password=sec/ret&size=2",
                "http://cam/video?user=me&Password=***&size=2",
            ),
            ("rtsp://cam/user=me_password=secret_channel=1", "rtsp://cam/user=me_password=***"),
            (
                "srt://cam:9000?mode=caller&passphrase=secret123",
                "srt://cam:9000?mode=caller&passphrase=***",
            ),
            (
                "http://me:one@cam/?token=two;key=three#four",
                "http://me:***@cam/?token=***;key=***#four",
            ),
            ("rtsp://me@cam/live", "rtsp://me@cam/live"),
            ("rtsp://me:@cam/live", "rtsp://me:@cam/live"),
            ("udp://@239.0.0.1:5000", "udp://@239.0.0.1:5000"),
            ("http://cam:8080/a:b@c", "http://cam:8080/a:b@c"),
            ("http://cam/a:b@c", "http://cam/a:b@c"),
            ("http://[fe80::1]:8080/a@b", "http://[fe80::1]:8080/a@b"),
            ("me:secret@cam", "me:secret@cam"),
        ] {
            assert_eq!(masked(address), shown);
        }
    }

    #[test]
    fn what_other_programs_print_of_a_password_is_hidden() {
        let secrets = Secrets::of(Some("rtsp://me:it%27s@cam/?key=k"), "-passphrase geheim1 -framerate 60");
        for (text, shown) in [
            ("rtsp://me:it%27s@cam/?key=k: refused", "rtsp://me:***@cam/?key=***: refused"),
            ("user me, password it's", "user me, password ***"),
            (
                "cannot set passphrase to geheim1 at framerate 60",
                "cannot set passphrase to *** at framerate 60",
            ),
            ("http://cam/?key=k is kept", "http://cam/?key=*** is kept"),
        ] {
            assert_eq!(secrets.hide(text), shown);
        }
        let short = Secrets::of(None, "-passphrase a");
        assert_eq!((short.hide("a"), short.hide("all")), ("***".into(), "all".into()));
    }

    properties! {
        #[test]
        fn no_address_shows_a_password(password in "[ -\"$-.0->@-~]{4,12}", user in "[a-z]{0,3}", path in "(/[a-z0-9]{0,5})?") {
            let address = format!("rtsp://{user}:{password}@cam:554{path}");
            prop_assume!(!address.replace(&password, "").contains(&password) && !"***".contains(&password));
            prop_assume!(!"rtsp://:***@cam:554".contains(&password) && !path.contains(&password));
            let shown = masked(&address);
            prop_assert!(!shown.contains(&password), "{}", shown);
            let told = Secrets::of(Some(&address), "").hide(&["cannot open", &address].join(" "));
            prop_assert!(!told.contains(&password), "{}", told);
        }
    }
}
