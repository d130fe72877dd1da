//! The frames of a recording, by file name.

use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};

use super::film;
use super::names::{has_ending, is_hidden, natural_order, number};
use super::stamps::Stamps;
pub use super::stamps::{FrameFile, Frames};

/// File extensions of pictures.
const PICTURES: [&str; 8] = ["png", "jpg", "jpeg", "jpe", "jfif", "pgm", "ppm", "pnm"];

/// The frames of folders, in the [natural order](natural_order) of their names, and single files, in the given order. A list in byte order,
/// such as a shell's expansion of `*`, is sorted naturally too.
///
/// If the names end in numbers that mostly rise by one, these are the frame numbers, and a gap means lost frames. Otherwise frames are
/// consecutive.
pub fn of(sources: &[PathBuf]) -> anyhow::Result<Vec<FrameFile>> {
    let mut frames = Vec::new();
    for source in sources {
        ensure!(
            source.as_os_str() != "-",
            "standard input (-) cannot be mixed with files: give it alone"
        );
        if !source.is_dir() {
            ensure!(!film::is_one(source), film::alone(source));
            frames.push(source.clone());
            continue;
        }
        let mut inside = pictures_in(source).with_context(|| format!("cannot read the folder {}", source.display()))?;
        ensure!(
            !inside.is_empty(),
            "the folder {} has no PNG, JPEG or PGM files; give a film by its own name",
            source.display()
        );
        inside.sort_by(|a, b| natural_order(a, b));
        frames.extend(inside);
    }
    if frames.is_sorted_by_key(|path| path.as_os_str()) {
        frames.sort_by(|a, b| natural_order(a, b));
    }
    let numbers = numbers(&frames);
    let files = frames.into_iter().zip(numbers);
    Ok(files.map(|(path, number)| FrameFile { path, number, late: 0.0 }).collect())
}

/// The frames by their times, if the only source is a folder with [time stamps](super::stamps); otherwise as [`of`].
pub fn by_time(sources: &[PathBuf]) -> anyhow::Result<Frames> {
    let files = of(sources)?;
    let stamps = match sources {
        [folder] if folder.is_dir() => Stamps::in_folder(folder)?,
        _ => None,
    };
    match stamps {
        Some(stamps) => stamps.order(files.into_iter().map(|file| file.path).collect()),
        None => Ok(Frames {
            files,
            rate: None,
            doubled: 0,
        }),
    }
}

/// Whether a file's name is a picture's.
pub fn is_picture(path: &Path) -> bool {
    has_ending(path, &PICTURES)
}

/// The pictures in a folder, unordered, without those whose names begin with a dot.
pub fn pictures_in(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let paths = std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path()));
    let mut paths: Vec<PathBuf> = paths.collect::<std::io::Result<_>>()?;
    paths.retain(|path| is_picture(path) && !is_hidden(path));
    Ok(paths)
}

/// Frame numbers from 0.
fn numbers(paths: &[PathBuf]) -> Vec<u64> {
    let counted = || (0..paths.len() as u64).collect();
    let Some(named) = paths.iter().map(|path| number(path)).collect::<Option<Vec<u64>>>() else {
        return counted();
    };
    let steps = || named.windows(2).map(|pair| pair[1].saturating_sub(pair[0]));
    let by_one = steps().filter(|&step| step == 1).count();
    if steps().any(|step| step == 0) || 2 * by_one < paths.len().saturating_sub(1) {
        return counted();
    }
    named.iter().map(|number| number - named[0]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbered(names: &[&str]) -> Vec<u64> {
        numbers(&names.iter().map(PathBuf::from).collect::<Vec<_>>())
    }

    #[test]
    fn frames_come_in_the_order_of_their_numbers() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["f0", "f1", "f2", "f9", "f10", "f11", "._f1", ".f3"] {
            std::fs::write(folder.path().join(format!("{name}.png")), "").unwrap();
        }
        let names = |sources: &[PathBuf]| -> Vec<String> {
            let names = of(sources).unwrap().into_iter().map(|file| file.path);
            names.map(|path| path.file_stem().unwrap().display().to_string()).collect()
        };
        let natural = ["f0", "f1", "f2", "f9", "f10", "f11"];
        assert_eq!(names(&[folder.path().into()]), natural);
        // A shell expands to byte order, a person gives any order.
        let given = |names: &[&str]| -> Vec<PathBuf> { names.iter().map(|name| folder.path().join(format!("{name}.png"))).collect() };
        assert_eq!(names(&given(&["f0", "f1", "f10", "f11", "f2", "f9"])), natural);
        assert_eq!(names(&given(&["f10", "f9", "f11"])), ["f10", "f9", "f11"]);
    }

    #[test]
    fn missing_numbers_are_lost_frames() {
        assert_eq!(numbered(&["a/f07.png", "a/f08.png", "a/f10.jpg", "a/f11.png"]), [0, 1, 3, 4]);
        // Times, every second frame, no numbers, two folders: consecutive frames.
        for names in [
            &["1000.png", "1010.png", "1021.png"][..],
            &["0.png", "2.png", "4.png"],
            &["a.png", "b1.png", "c2.png"],
            &["a/1.png", "a/2.png", "b/1.png", "b/2.png"],
            &["99999999999999999999.png", "99999999999999999998.png"],
        ] {
            let counted: Vec<u64> = (0..names.len() as u64).collect();
            assert_eq!(numbered(names), counted, "{names:?}");
        }
        assert!(numbered(&[]).is_empty());
        assert_eq!(numbered(&["x.png"]), [0]);
    }
}
