//! Writes files atomically.

use std::fs::File;
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use atomic_write_file::AtomicWriteFile;

use crate::output::{Output, unless_left};
use crate::stop;

/// Destination of a path's bytes.
enum Place {
    /// Standard output, after what is already printed.
    Output,
    /// A device or a pipe, written in place.
    Device,
    /// A file, replaced atomically.
    File(PathBuf),
}

pub fn write(path: &Path, bytes: impl AsRef<[u8]>) -> anyhow::Result<()> {
    write_with(path, |file| Ok(file.write_all(bytes.as_ref())?))
}

/// Writes a temporary file and renames it into place, so that no reader sees a partial file, even after a power cut; a device or a pipe is
/// written in place.
///
/// # Errors
/// Errors of `write`, and an error if not every byte can be written; the previous file is then unchanged.
pub fn write_with(path: &Path, write: impl FnOnce(&mut dyn Write) -> anyhow::Result<()>) -> anyhow::Result<()> {
    write_to(path, write).with_context(|| format!("cannot write {}", path.display()))
}

/// Creates a file that other users cannot read.
pub fn write_secret(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut options = File::options();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let mut file = options.open(path)?;
    let written = file.write_all(bytes).and_then(|()| file.sync_all());
    if written.is_err() {
        // A partial secret is useless.
        let _ = std::fs::remove_file(path);
    }
    written
}

/// Checks that a file is writable, without changing anything. Returns whether it is a regular file, not a device or a pipe.
pub fn check(path: &Path) -> anyhow::Result<bool> {
    let aside = |place| match place {
        Place::File(file) => AtomicWriteFile::open(file)?.discard().map(|()| true),
        Place::Output | Place::Device => Ok(false),
    };
    place(path)
        .and_then(|place| Ok(aside(place)?))
        .with_context(|| format!("cannot write {}", path.display()))
}

/// Checks that a file is writable and does not exist yet, because it may hold measurements. A device or a pipe is accepted.
pub fn check_new(path: &Path) -> anyhow::Result<()> {
    ensure!(
        !check(path)? || !path.exists(),
        "{} exists and is not overwritten: give another file",
        path.display()
    );
    Ok(())
}

fn write_to(path: &Path, write: impl FnOnce(&mut dyn Write) -> anyhow::Result<()>) -> anyhow::Result<()> {
    let place = place(path)?;
    let whole = matches!(place, Place::File(_)).then(stop::writing);
    let mut growing = Growing::open(place, path)?;
    let written = write_through(&mut growing, write).and_then(|()| Ok(growing.put()?));
    if written.is_ok() && whole.is_some() {
        stop::written();
    }
    drop(whole);
    stop::give_way();
    written
}

/// A temporary file, written while the program works, that [`Growing::keep`] renames into place and dropping discards; a device or a pipe
/// is written in place.
pub struct Growing(Target);

enum Target {
    Through(Box<dyn Write + Send>),
    Aside(AtomicWriteFile),
    Active(Active),
}

/// A readable file next to its final place. It survives once flushed.
struct Active {
    file: File,
    path: PathBuf,
    place: PathBuf,
    stays: bool,
}

impl Drop for Active {
    fn drop(&mut self) {
        if !self.stays {
            // Never flushed, so nothing depends on it.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// The path of a growing file that can be read meanwhile.
pub fn active(path: &Path) -> PathBuf {
    let mut path = path.as_os_str().to_owned();
    path.push(".active");
    path.into()
}

impl Growing {
    /// A file with the suffix `.active` that can be read while it grows, and survives if the program is killed.
    pub fn create_active(path: &Path) -> anyhow::Result<Self> {
        let Place::File(place) = place(path).with_context(|| format!("cannot write {}", path.display()))? else {
            return Self::create(path);
        };
        let path = active(&place);
        let file = File::create_new(&path).with_context(|| match path.exists() {
            true => format!(
                "{} is in use, or left from an interrupted recording: move it away, or give another file",
                path.display()
            ),
            false => format!("cannot write {}", path.display()),
        })?;
        let stays = false;
        Ok(Self(Target::Active(Active { file, path, place, stays })))
    }

    pub fn create(path: &Path) -> anyhow::Result<Self> {
        place(path)
            .and_then(|place| Ok(Self::open(place, path)?))
            .with_context(|| format!("cannot write {}", path.display()))
    }

    /// Renames the file into place.
    ///
    /// # Errors
    /// If not every byte can be written; the previous file is then unchanged.
    pub fn keep(self) -> std::io::Result<()> {
        let whole = (!matches!(self.0, Target::Through(_))).then(stop::writing);
        self.put()?;
        if whole.is_some() {
            stop::written();
        }
        Ok(())
    }

    /// Writes all bytes to the disk, so that [`Growing::keep`] is quick and unlikely to fail.
    fn settle(&mut self) -> std::io::Result<()> {
        self.flush()?;
        match &self.0 {
            Target::Through(_) => Ok(()),
            Target::Aside(file) => file.as_file().sync_all(),
            Target::Active(active) => active.file.sync_all(),
        }
    }

    /// Whether another file has its place by now.
    fn is_overtaken(&self, path: &Path) -> bool {
        !matches!(self.0, Target::Through(_)) && path.exists()
    }

    fn open(place: Place, path: &Path) -> std::io::Result<Self> {
        Ok(Self(match place {
            Place::Output => Target::Through(Box::new(Output)),
            Place::Device => Target::Through(Box::new(Pipe(File::options().append(true).open(path)?))),
            Place::File(file) => Target::Aside(AtomicWriteFile::open(file)?),
        }))
    }

    /// [`Growing::keep`] for callers that already block the program's exit.
    fn put(mut self) -> std::io::Result<()> {
        self.flush()?;
        match self.0 {
            Target::Through(_) => Ok(()),
            Target::Aside(file) => file.commit(),
            Target::Active(active) => {
                active.file.sync_all()?;
                std::fs::rename(&active.path, &active.place)
            }
        }
    }

    fn writer(&mut self) -> &mut dyn Write {
        match &mut self.0 {
            Target::Through(device) => device,
            Target::Aside(file) => file,
            Target::Active(active) => &mut active.file,
        }
    }
}

/// A pipe or a device.
pub struct Pipe(pub File);

impl Write for Pipe {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        unless_left(self.0.write(bytes), bytes.len(), || ())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        unless_left(self.0.flush(), (), || ())
    }
}

impl Write for Growing {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        stop::allow()?;
        self.writer().write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        if let Target::Active(active) = &mut self.0 {
            active.stays = true;
            stop::written();
        }
        self.writer().flush()
    }
}

/// Files only: a device or a pipe has no positions.
impl Seek for Growing {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        match &mut self.0 {
            Target::Through(_) => {
                let why = "it is a device or a pipe, and this file is not written sequentially: give a file";
                Err(std::io::Error::new(std::io::ErrorKind::NotSeekable, why))
            }
            Target::Aside(file) => file.seek(to),
            Target::Active(active) => active.file.seek(to),
        }
    }
}

/// Renames new files into place, in this order: all of them, or none. The last one shows that the others are complete.
///
/// # Errors
/// If not every byte can be written, or a file has appeared in the place of one; no file is then kept.
pub fn keep_new(mut files: Vec<(PathBuf, Growing)>) -> anyhow::Result<()> {
    let cannot = |path: &Path| format!("cannot write {}", path.display());
    for (path, file) in &mut files {
        file.settle().with_context(|| cannot(path))?;
    }
    let whole = stop::writing();
    let mut kept: Vec<PathBuf> = Vec::with_capacity(files.len());
    let put = files.iter().try_for_each(|(path, file)| {
        ensure!(
            !file.is_overtaken(path),
            "{} was created meanwhile and is not overwritten: give another path",
            path.display()
        );
        Ok(())
    });
    let put = put.and_then(|()| {
        files.into_iter().try_for_each(|(path, file)| {
            file.put().with_context(|| cannot(&path))?;
            kept.push(path);
            Ok(())
        })
    });
    match put {
        Ok(()) => stop::written(),
        // Some files without the others are useless.
        Err(_) => kept.iter().for_each(|path| drop(std::fs::remove_file(path))),
    }
    drop(whole);
    stop::give_way();
    put
}

/// Writes all bytes, and reports errors of the final flush.
fn write_through(target: &mut impl Write, write: impl FnOnce(&mut dyn Write) -> anyhow::Result<()>) -> anyhow::Result<()> {
    let mut buffer = BufWriter::new(target);
    write(&mut buffer)?;
    Ok(buffer.flush()?)
}

/// Destination of a path's bytes, or an error if the path is not writable.
fn place(path: &Path) -> anyhow::Result<Place> {
    // Standard output may be a file; replacing it would lose the other output.
    if path == Path::new("/dev/stdout") {
        return Ok(Place::Output);
    }
    match std::fs::metadata(path) {
        Ok(there) if there.is_dir() => bail!("it is a folder: give a file"),
        Ok(there) if !there.is_file() => Ok(Place::Device),
        Ok(there) => {
            ensure!(!there.permissions().readonly(), "it is write-protected: give another file");
            // Replace a link's target, not the link.
            Ok(Place::File(path.canonicalize()?))
        }
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            if let Ok(target) = path.read_link() {
                bail!("it is a link to {}, which does not exist: give that file itself", target.display());
            }
            Ok(Place::File(path.into()))
        }
        Err(error) => Err(error.into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).expect("a folder");
        let mut names: Vec<String> = entries
            .map(|entry| entry.expect("an entry").file_name().into_string())
            .collect::<Result<_, _>>()
            .expect("plain names");
        names.sort();
        names
    }

    #[test]
    fn what_fails_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("file");
        write(&path, "old").expect("written");
        let error = write_with(&path, |file| {
            file.write_all(&[b'x'; 100_000])?;
            bail!("no more")
        });
        let said = format!("{:#}", error.expect_err("it failed"));
        assert!(said.contains("cannot write") && said.contains("no more"));
        assert_eq!(std::fs::read(&path).expect("there"), b"old");
        assert_eq!(names(folder.path()), ["file"]);
        write(&path, "new").expect("written");
        assert_eq!(std::fs::read(&path).expect("there"), b"new");
    }

    #[test]
    fn folders_and_protected_files_are_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let refusal = |path: &Path| format!("{:#}", write(path, "new").expect_err("refused"));
        assert!(refusal(folder.path()).contains("it is a folder"));
        assert!(refusal(&folder.path().join("none/file")).contains("cannot write"));
        let path = folder.path().join("file");
        write(&path, "old").expect("written");
        let mut permissions = std::fs::metadata(&path).expect("there").permissions();
        permissions.set_readonly(true);
        std::fs::set_permissions(&path, permissions).expect("protected");
        assert!(refusal(&path).contains("write-protected"));
        assert_eq!(std::fs::read(&path).expect("there"), b"old");
    }

    #[test]
    fn what_is_active_can_be_read_and_replaces_nothing_before_its_end() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("file");
        write(&path, "old").expect("written");
        drop(Growing::create_active(&path).expect("a file"));
        assert_eq!(names(folder.path()), ["file"]);
        let mut growing = Growing::create_active(&path).expect("a file");
        growing.write_all(b"new").and_then(|()| growing.flush()).expect("written");
        let active = folder.path().join("file.active");
        assert_eq!(std::fs::read(&active).expect("there"), b"new");
        let refused = Growing::create_active(&path).err().expect("refused");
        assert!(format!("{refused:#}").contains("move it away"), "{refused:#}");
        assert_eq!(std::fs::read(&path).expect("there"), b"old");
        growing.keep().expect("kept");
        assert_eq!(std::fs::read(&path).expect("there"), b"new");
        assert_eq!(names(folder.path()), ["file"]);
        let mut torn = Growing::create_active(&path).expect("a file");
        torn.write_all(b"torn").and_then(|()| torn.flush()).expect("written");
        drop(torn);
        assert_eq!(names(folder.path()), ["file", "file.active"]);
    }

    #[test]
    fn several_are_kept_together_or_not_at_all() {
        let folder = tempfile::tempdir().expect("a folder");
        let paths = ["data", "more", "about"].map(|name| folder.path().join(name));
        let grown = || {
            let files = paths.iter().map(|path| {
                let mut file = Growing::create(path).expect("a file");
                file.write_all(b"new").expect("room");
                (path.clone(), file)
            });
            files.collect::<Vec<_>>()
        };
        let files = grown();
        write(&paths[1], "mine").expect("written");
        let refused = format!("{:#}", keep_new(files).expect_err("overtaken"));
        assert!(refused.contains("more was created meanwhile"), "{refused}");
        assert_eq!(names(folder.path()), ["more"]);
        assert_eq!(std::fs::read(&paths[1]).expect("there"), b"mine");
        std::fs::remove_file(&paths[1]).expect("removed");
        // A failure at the last file removes the others, too.
        #[cfg(unix)]
        {
            let lost = folder.path().join("lost");
            std::fs::create_dir(&lost).expect("room");
            let last = lost.join("about");
            let mut files = grown();
            files[2] = (last.clone(), Growing::create(&last).expect("a file"));
            std::fs::remove_dir_all(&lost).expect("removed");
            let refused = format!("{:#}", keep_new(files).expect_err("no folder"));
            assert!(refused.contains("cannot write") && refused.contains("about"), "{refused}");
            assert_eq!(names(folder.path()), [""; 0]);
        }
        keep_new(grown()).expect("kept");
        assert_eq!(names(folder.path()), ["about", "data", "more"]);
    }

    #[cfg(unix)]
    #[test]
    fn links_stay_and_lead_to_something() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().expect("a folder");
        let [file, link, dangling] = ["file", "link", "dangling"].map(|name| folder.path().join(name));
        write(&file, "old").expect("written");
        std::fs::set_permissions(&file, PermissionsExt::from_mode(0o640)).expect("set");
        symlink("file", &link).expect("a link");
        symlink("nowhere", &dangling).expect("a link");
        write(&link, "new").expect("written");
        assert_eq!(std::fs::read(&file).expect("there"), b"new");
        let mode = std::fs::metadata(&file).expect("there").permissions().mode();
        assert_eq!(mode & 0o777, 0o640);
        assert!(link.is_symlink());
        let said = format!("{:#}", write(&dangling, "new").expect_err("refused"));
        assert!(said.contains("nowhere"), "{said}");
        assert_eq!(names(folder.path()), ["dangling", "file", "link"]);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_device_is_told() {
        for bytes in [1, 100_000] {
            let error = write(Path::new("/dev/full"), vec![0; bytes]).expect_err("full");
            assert!(format!("{error:#}").contains("No space left"));
        }
    }
}
