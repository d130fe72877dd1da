//! File type and frame number by file name.

use std::cmp::Ordering;
use std::path::Path;

/// Whether a name has one of these extensions, in any case.
pub fn has_ending(path: &Path, endings: &[&str]) -> bool {
    let ending = path.extension().unwrap_or_default();
    endings.iter().any(|known| ending.eq_ignore_ascii_case(known))
}

/// The number at the end of a name.
pub fn number(path: &Path) -> Option<u64> {
    let stem = path.file_stem()?.to_str()?;
    let digits = stem.len() - stem.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    stem[stem.len() - digits..].parse().ok()
}

/// Whether a name begins with a dot: files of the system, such as `._frame.png` on macOS.
pub fn is_hidden(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default();
    name.as_encoded_bytes().starts_with(b".")
}

/// Natural order, with `frame2` before `frame10`: consecutive digits compare as one number, all else by byte.
///
/// Names that are decimal numbers, such as seconds, compare as numbers: `0.15.png` comes before `0.2.png`.
pub fn natural_order(a: &Path, b: &Path) -> Ordering {
    let names = [a, b].map(|path| path.as_os_str().as_encoded_bytes());
    let [mut a_rest, mut b_rest] = names;
    let are_decimal = [a, b].into_iter().all(is_decimal);
    let mut after_point = false;
    while let ([a_first, ..], [b_first, ..]) = (a_rest, b_rest) {
        let order = match a_first.is_ascii_digit() && b_first.is_ascii_digit() {
            true => {
                let [a_number, b_number] = [&mut a_rest, &mut b_rest].map(take_digits);
                if after_point {
                    a_number.cmp(b_number)
                } else {
                    let [a_number, b_number] = [a_number, b_number].map(without_zeros);
                    a_number.len().cmp(&b_number.len()).then(a_number.cmp(b_number))
                }
            }
            false => {
                after_point = are_decimal && *a_first == b'.';
                (a_rest, b_rest) = (&a_rest[1..], &b_rest[1..]);
                a_first.cmp(b_first)
            }
        };
        if order.is_ne() {
            return order;
        }
    }
    // Equal numbers with different leading zeros.
    a_rest.len().cmp(&b_rest.len()).then(names[0].cmp(names[1]))
}

/// Whether a name without its extension is a decimal number.
fn is_decimal(path: &Path) -> bool {
    let stem = path.file_stem().unwrap_or_default().as_encoded_bytes();
    let points = stem.iter().filter(|&&byte| byte == b'.').count();
    points == 1 && stem.iter().all(|&byte| byte.is_ascii_digit() || byte == b'.')
}

/// Removes and returns a name's leading digits.
fn take_digits<'a>(name: &mut &'a [u8]) -> &'a [u8] {
    let count = name.iter().take_while(|byte| byte.is_ascii_digit()).count();
    let (digits, rest) = name.split_at(count);
    *name = rest;
    digits
}

fn without_zeros(digits: &[u8]) -> &[u8] {
    let zeros = digits.iter().take_while(|&&digit| digit == b'0').count();
    &digits[zeros..]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_names_count_as_numbers() {
        for names in [
            &["f0.png", "f1.png", "f2.png", "f10.png", "f11.png", "f100.png"][..],
            &["a/f9.png", "a/f10.png", "b/f1.png"],
            &["f000009.png", "f000010.png", "f1000000.png"],
            &["take2-9.png", "take2-10.png", "take10-1.png"],
            &["take1.9.png", "take1.10.png"],
            &["2026.11.9.png", "2026.11.10.png"],
            &["1.5/f2.png", "1.5/f10.png"],
            &["f01.png", "f1.png", "f2.png"],
            &["0.15.png", "0.2.png", "1.05.png", "1.5.png", "10.25.png"],
            &["f.png", "f0.png", "fa.png"],
            &["18446744073709551615.png", "18446744073709551616.png"],
        ] {
            let mut sorted = names.to_vec();
            sorted.reverse();
            sorted.sort_by(|a, b| natural_order(Path::new(a), Path::new(b)));
            assert_eq!(sorted, names);
        }
    }
}
