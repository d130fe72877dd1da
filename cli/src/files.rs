//! Files that are written whole or not at all.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use atomic_write_file::AtomicWriteFile;

use crate::output::{Output, unless_left};
use crate::stop;

/// Where the bytes of a path go.
enum Place {
    /// To standard output, after what was printed there.
    Output,
    /// To a device or a pipe, which is written to and not replaced.
    Device,
    /// To a file, which is replaced.
    File(PathBuf),
}

/// Writes a file.
pub fn write(path: &Path, bytes: impl AsRef<[u8]>) -> anyhow::Result<()> {
    write_with(path, |file| Ok(file.write_all(bytes.as_ref())?))
}

/// Writes a file aside and then puts it into its place, so that nobody finds half a file, not even after a power cut; a device or a pipe
/// is written to as it is.
///
/// # Errors
/// Those of `write`, and when not every byte can be kept; what was there before is untouched.
pub fn write_with(path: &Path, write: impl FnOnce(&mut dyn Write) -> anyhow::Result<()>) -> anyhow::Result<()> {
    write_to(path, write).with_context(|| format!("cannot write {}", path.display()))
}

/// Writes a new file that nobody else can read.
pub fn write_secret(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut options = File::options();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let mut file = options.open(path)?;
    let written = file.write_all(bytes).and_then(|()| file.sync_all());
    if written.is_err() {
        // Half a secret is none.
        let _ = std::fs::remove_file(path);
    }
    written
}

/// Looks whether a file can be written, and leaves everything as it is. Returns whether it is one: a device or a pipe is not.
pub fn check(path: &Path) -> anyhow::Result<bool> {
    let aside = |place| match place {
        Place::File(file) => AtomicWriteFile::open(file)?.discard().map(|()| true),
        Place::Output | Place::Device => Ok(false),
    };
    place(path)
        .and_then(|place| Ok(aside(place)?))
        .with_context(|| format!("cannot write {}", path.display()))
}

/// Looks whether a file can be written, and none is there: that may be what somebody has measured. A device or a pipe holds nothing.
pub fn check_new(path: &Path) -> anyhow::Result<()> {
    ensure!(
        !check(path)? || !path.exists(),
        "{} is there already, and stays as it is: name another file",
        path.display()
    );
    Ok(())
}

fn write_to(path: &Path, write: impl FnOnce(&mut dyn Write) -> anyhow::Result<()>) -> anyhow::Result<()> {
    let place = place(path)?;
    let whole = matches!(place, Place::File(_)).then(stop::writing);
    let mut growing = Growing::open(place, path)?;
    let written = write_through(&mut growing, write).and_then(|()| Ok(growing.put()?));
    drop(whole);
    stop::give_way();
    written
}

/// A file that is written while the program works, aside, and is put into its place by [`Growing::keep`], or is not there; a device or a
/// pipe is written to as it is.
pub struct Growing(Target);

enum Target {
    Through(Box<dyn Write>),
    Aside(AtomicWriteFile),
    Active(Active),
}

/// A file beside its place, under a name of its own. It stays there once it was flushed.
struct Active {
    file: File,
    path: PathBuf,
    place: PathBuf,
    stays: bool,
}

impl Drop for Active {
    fn drop(&mut self) {
        if !self.stays {
            // Nothing was promised of it.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

impl Growing {
    /// One that can be read while it grows, under its name and `.active`, and stays there where the program is ended in the middle.
    pub fn create_active(path: &Path) -> anyhow::Result<Self> {
        let Place::File(place) = place(path).with_context(|| format!("cannot write {}", path.display()))? else {
            return Self::create(path);
        };
        let mut path = place.clone().into_os_string();
        path.push(".active");
        let path = PathBuf::from(path);
        let file = File::create_new(&path).with_context(|| match path.exists() {
            true => format!(
                "{} is still written, or is left of a recording that was ended in the middle: move it away, or name another file",
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

    /// Puts it into its place.
    ///
    /// # Errors
    /// When not every byte can be kept; what was there before is untouched.
    pub fn keep(self) -> std::io::Result<()> {
        let _whole = (!matches!(self.0, Target::Through(_))).then(stop::writing);
        self.put()
    }

    fn open(place: Place, path: &Path) -> std::io::Result<Self> {
        Ok(Self(match place {
            Place::Output => Target::Through(Box::new(Output)),
            Place::Device => Target::Through(Box::new(Pipe(File::options().append(true).open(path)?))),
            Place::File(file) => Target::Aside(AtomicWriteFile::open(file)?),
        }))
    }

    /// [`Growing::keep`] for callers that already delay the program's end.
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
        }
        self.writer().flush()
    }
}

/// Writes all bytes, and not into a buffer that takes them and loses them later.
fn write_through(target: &mut impl Write, write: impl FnOnce(&mut dyn Write) -> anyhow::Result<()>) -> anyhow::Result<()> {
    let mut buffer = BufWriter::new(target);
    write(&mut buffer)?;
    Ok(buffer.flush()?)
}

/// Where the bytes of a path go; an error where they should not.
fn place(path: &Path) -> anyhow::Result<Place> {
    // It may lead to a file, and the rest of the output goes there too.
    if path == Path::new("/dev/stdout") {
        return Ok(Place::Output);
    }
    match std::fs::metadata(path) {
        Ok(there) if there.is_dir() => bail!("it is a folder: name a file"),
        Ok(there) if !there.is_file() => Ok(Place::Device),
        Ok(there) => {
            ensure!(!there.permissions().readonly(), "it is write-protected: name another file");
            // A link stays, and the file that it leads to is replaced.
            Ok(Place::File(path.canonicalize()?))
        }
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            if let Ok(target) = path.read_link() {
                bail!("it is a link to {}, which is not there: name that file itself", target.display());
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
