//! Checks a command's output files before it works: no input is overwritten, and an unwritable file fails before the computation.

use std::collections::HashSet;
use std::ffi::OsStr;
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use sim::scene::{Scene, preset_toml};

use crate::files;
use crate::frames::files::pictures_in;

/// Checks each output file; `read` are the command's inputs.
pub fn check(written: impl IntoIterator<Item = PathBuf>, read: impl IntoIterator<Item = PathBuf>) -> anyhow::Result<()> {
    let mut taken: Vec<PathBuf> = read.into_iter().map(|path| real(&path)).collect();
    let inputs = taken.len();
    for path in written {
        if !files::check(&path)? {
            continue;
        }
        let own = real(&path);
        match taken.iter().position(|other| *other == own) {
            Some(place) if place < inputs => bail!("{} is an input, and would be overwritten: give another file", path.display()),
            Some(_) => bail!("{} would be written twice: give two files", path.display()),
            None => taken.push(own),
        }
    }
    Ok(())
}

/// Checks files that belong to another: if that one does not exist, they belong to something else.
pub fn check_beside(file: &Path, beside: &[PathBuf]) -> anyhow::Result<()> {
    let foreign = beside.iter().find(|path| !file.exists() && path.exists());
    match foreign {
        Some(foreign) => bail!(
            "{} exists without {}, so it belongs to something else and would be overwritten: give the output another name",
            foreign.display(),
            file.display()
        ),
        None => Ok(()),
    }
}

/// Checks a folder for frames: it must be free of pictures that `vocc receive` would read as frames, from an older run or any other origin.
pub fn check_recording(folder: &Path) -> anyhow::Result<()> {
    let pictures = pictures_in(folder).with_context(|| format!("cannot read the folder {}", folder.display()))?;
    if let Some(picture) = pictures.iter().min() {
        bail!(
            "{} already holds frames, such as {}, and two recordings would be read as one: give a new folder, or remove these pictures \
             yourself",
            folder.display(),
            picture.file_name().unwrap_or_default().display()
        );
    }
    files::check(&frame_in(folder, 0)).map(drop)
}

/// Path of a recording's frame of this number.
pub fn frame_in(folder: &Path, number: u64) -> PathBuf {
    folder.join(format!("frame-{number:06}.png"))
}

/// Creates a folder for drawings of the pictures that a command reads, and checks that these files can be written there, by the first.
/// Fails if the folder holds one of those pictures, because the next run would read the drawings, too.
pub fn check_drawings<'a>(
    folder: &Path,
    drawings: impl IntoIterator<Item = PathBuf>,
    mut read: impl Iterator<Item = &'a Path>,
) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
    ensure!(
        !read.any(|picture| is_same(picture.parent().unwrap_or(picture), folder)),
        "{} holds frames to read, and the pictures of --show would be read as frames, too: give another folder",
        folder.display()
    );
    let mut names = HashSet::new();
    for drawing in drawings {
        let path = folder.join(&drawing);
        if names.is_empty() {
            files::check(&path)?;
        }
        ensure!(
            names.insert(drawing),
            "{} would be written twice, for two pictures of one name: give them to two runs, each with its own folder",
            path.display()
        );
    }
    Ok(())
}

/// Locks a folder for this run while the result lives, because two runs would overwrite each other's work. The system releases the lock
/// however the run ends. `None` on systems that cannot lock folders.
///
/// A run with a single file uses [`crate::results::Place`]: each write replaces the file, and a lock on it would be lost.
pub fn hold(folder: &Path) -> anyhow::Result<Option<File>> {
    let Ok(held) = File::open(folder) else {
        return Ok(None);
    };
    lock(held, || {
        format!("another run uses {}: wait for its end, or give another folder", folder.display())
    })
}

/// Locks an open file while the result lives; `None` if it cannot be locked.
pub fn lock(open: File, taken: impl FnOnce() -> String) -> anyhow::Result<Option<File>> {
    match open.try_lock() {
        Ok(()) => Ok(Some(open)),
        Err(TryLockError::WouldBlock) => bail!(taken()),
        Err(TryLockError::Error(_)) => Ok(None),
    }
}

/// The files that a scene is read from; `name` is its name on the command line.
pub fn files_of(name: &OsStr, scene: &Scene) -> Vec<PathBuf> {
    let own = name.to_str().and_then(preset_toml).is_none().then(|| PathBuf::from(name));
    let others = [&scene.link.table, &scene.ambient.background_image];
    own.into_iter().chain(others.into_iter().flatten().map(PathBuf::from)).collect()
}

/// Whether two paths are the same file.
pub fn is_same(one: &Path, other: &Path) -> bool {
    real(one) == real(other)
}

/// A path without links and dots; a missing file is resolved by its folder.
fn real(path: &Path) -> PathBuf {
    // A file in the current folder has no parent in its path.
    let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
    let in_folder = || {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new(".")).canonicalize().ok()?;
        Some(folder.join(path.file_name()?))
    };
    path.canonicalize().ok().or_else(in_folder).unwrap_or_else(|| path.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_is_read_is_written_and_nothing_twice() {
        let folder = tempfile::tempdir().expect("a folder");
        let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
        let around = folder.path().join("..").join(folder.path().file_name().expect("a name")).join("a");
        std::fs::write(&a, "a").expect("written");
        assert!(check([b.clone()], [a.clone()]).is_ok());
        let refusal = |written: &[&PathBuf], read: &[&PathBuf]| {
            let paths = |paths: &[&PathBuf]| paths.iter().copied().cloned().collect::<Vec<_>>();
            check(paths(written), paths(read)).expect_err("refused").to_string()
        };
        assert!(refusal(&[&around], &[&a]).contains("is an input"));
        assert!(refusal(&[&a, &around], &[&b]).contains("written twice"));
        assert!(refusal(&[&b, &b], &[]).contains("written twice"));
        assert!(refusal(&[&folder.path().join("no/file")], &[]).contains("cannot write"));
        assert_eq!(std::fs::read(&a).expect("there"), b"a");
        assert!(!b.exists());
    }

    #[test]
    fn a_folder_is_one_runs_at_a_time() {
        let folder = tempfile::tempdir().expect("a folder");
        let first = hold(folder.path()).expect("free");
        if first.is_none() {
            return;
        }
        let second = hold(folder.path()).expect_err("held").to_string();
        assert!(second.contains("another run uses"), "{second}");
        drop(first);
        assert!(hold(folder.path()).is_ok());
    }

    #[test]
    fn what_stands_alone_is_of_something_else() {
        let folder = tempfile::tempdir().expect("a folder");
        let [file, table] = ["run.json", "run.csv"].map(|name| folder.path().join(name));
        assert!(check_beside(&file, std::slice::from_ref(&table)).is_ok());
        std::fs::write(&table, "mine").expect("written");
        assert!(check_beside(&file, std::slice::from_ref(&table)).is_err());
        std::fs::write(&file, "{}").expect("written");
        assert!(check_beside(&file, &[table]).is_ok());
    }
}
