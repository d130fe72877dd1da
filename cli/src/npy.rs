//! Writes NumPy's files: a single array (NPY, version 1.0), or several arrays that grow in parallel, in a folder or in one archive (NPZ).
//!
//! An archive is a ZIP file of uncompressed NPY files. All shapes are known from the start, so each array has a fixed place in the archive
//! and is written there as it grows.

use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};

use crate::files::{self, Growing};

/// The first bytes of an NPY file.
const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";
/// NumPy requires the numbers to begin at a multiple of 64; no header here is longer.
const HEADER: usize = 128;

/// A number type of NumPy files.
pub trait Number: Copy {
    /// NumPy's name of the type.
    const NAME: &str;
    /// The bytes in little-endian order.
    fn bytes(self) -> impl AsRef<[u8]>;
}

impl Number for f32 {
    const NAME: &str = "<f4";
    fn bytes(self) -> impl AsRef<[u8]> {
        self.to_le_bytes()
    }
}

impl Number for f64 {
    const NAME: &str = "<f8";
    fn bytes(self) -> impl AsRef<[u8]> {
        self.to_le_bytes()
    }
}

/// Writes a matrix: whole or not at all.
pub fn write_matrix<T: Number>(path: &Path, values: &[T], width: usize, height: usize) -> anyhow::Result<()> {
    files::write_with(path, |file| {
        file.write_all(&header(T::NAME, &[height as u64, width as u64]))?;
        for value in values {
            file.write_all(value.bytes().as_ref())?;
        }
        Ok(())
    })
}

fn header(kind: &str, shape: &[u64]) -> [u8; HEADER] {
    let sides = shape.iter().map(|side| format!("{side},"));
    let sides = sides.collect::<Vec<_>>().join(" ");
    // A tuple of one element ends with a comma, as in Python.
    let sides = if shape.len() > 1 { sides.trim_end_matches(',') } else { &sides };
    let about = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({sides}), }}");
    let mut header = [b' '; HEADER];
    let padded = HEADER - MAGIC.len() - 2;
    header[..MAGIC.len()].copy_from_slice(MAGIC);
    header[MAGIC.len()..][..2].copy_from_slice(&(padded as u16).to_le_bytes());
    header[MAGIC.len() + 2..][..about.len()].copy_from_slice(about.as_bytes());
    header[HEADER - 1] = b'\n';
    header
}

/// An array to be written.
#[derive(Clone, Debug)]
pub struct Array {
    /// The array's name, without a suffix.
    pub name: &'static str,
    /// NumPy's name of the number type: `|u1`, `|b1` or `<f4`.
    pub kind: &'static str,
    pub shape: Vec<u64>,
}

impl Array {
    /// The name of its file.
    pub fn file(&self) -> String {
        format!("{}.npy", self.name)
    }

    /// Bytes of its file.
    fn size(&self) -> u64 {
        let number = if self.kind.ends_with('4') { 4 } else { 1 };
        self.shape.iter().product::<u64>() * number + HEADER as u64
    }
}

/// Arrays that grow in parallel; on closing, all are kept together.
pub enum Arrays {
    /// A file each.
    Folder(Vec<(PathBuf, Growing)>),
    /// One file.
    Archive(Archive),
}

/// An uncompressed ZIP file of NPY files.
pub struct Archive {
    file: Growing,
    entries: Vec<Entry>,
    path: PathBuf,
}

/// An array in an archive.
struct Entry {
    name: String,
    /// The offset of its header in the archive.
    at: u64,
    /// Bytes of its file.
    size: u64,
    /// Bytes written so far.
    written: u64,
    checksum: crc32fast::Hasher,
}

/// Maximum size of an archive in bytes: larger ones need another kind of ZIP file, which not every program reads.
pub const ARCHIVE_MAX: u64 = u32::MAX as u64;
/// Bytes before an array in an archive, without its name.
const LOCAL: u64 = 30;
/// Bytes of an array in the list at an archive's end, without its name.
const LISTED: u64 = 46;
/// Bytes at an archive's end.
const END: u64 = 22;

/// Bytes of an archive of these arrays.
pub fn archive_size(arrays: &[Array]) -> u64 {
    let each = arrays
        .iter()
        .map(|array| array.size() + 2 * array.file().len() as u64 + LOCAL + LISTED);
    each.sum::<u64>() + END
}

impl Arrays {
    /// Creates a file for each array in a folder, in which the names must be free.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn in_folder(folder: &Path, arrays: &[Array]) -> anyhow::Result<Self> {
        let begun = arrays.iter().map(|array| {
            let path = folder.join(array.file());
            let mut file = Growing::create(&path)?;
            let written = file.write_all(&header(array.kind, &array.shape));
            written.with_context(|| format!("cannot write {}", path.display()))?;
            Ok((path, file))
        });
        begun.collect::<anyhow::Result<_>>().map(Self::Folder)
    }

    /// Creates one file for all arrays.
    ///
    /// # Errors
    /// If it cannot be written, or would be larger than [`ARCHIVE_MAX`].
    pub fn in_archive(path: &Path, arrays: &[Array]) -> anyhow::Result<Self> {
        ensure!(
            archive_size(arrays) <= ARCHIVE_MAX,
            "an archive of {} bytes is larger than {ARCHIVE_MAX}: write fewer frames, or give a folder",
            archive_size(arrays)
        );
        let mut at = 0;
        let entries = arrays.iter().map(|array| {
            let entry = Entry {
                name: array.file(),
                at,
                size: array.size(),
                written: 0,
                checksum: crc32fast::Hasher::new(),
            };
            at = entry.begin() + entry.size;
            entry
        });
        let entries = entries.collect();
        let file = Growing::create(path)?;
        let path = path.to_owned();
        let mut archive = Archive { file, entries, path };
        for (place, array) in arrays.iter().enumerate() {
            archive.append(place, &header(array.kind, &array.shape))?;
        }
        Ok(Self::Archive(archive))
    }

    /// Appends to the array with this index.
    ///
    /// # Errors
    /// If not every byte can be written.
    pub fn append(&mut self, place: usize, bytes: &[u8]) -> anyhow::Result<()> {
        match self {
            Self::Folder(files) => {
                let (path, file) = &mut files[place];
                file.write_all(bytes).with_context(|| format!("cannot write {}", path.display()))
            }
            Self::Archive(archive) => archive.append(place, bytes),
        }
    }

    /// The complete files with their paths, for [`files::keep_new`].
    ///
    /// # Errors
    /// If bytes are missing, or if the last ones cannot be written.
    pub fn close(self) -> anyhow::Result<Vec<(PathBuf, Growing)>> {
        match self {
            Self::Folder(files) => Ok(files),
            Self::Archive(archive) => Ok(vec![archive.close()?]),
        }
    }
}

impl Entry {
    /// The offset of the array in the archive.
    fn begin(&self) -> u64 {
        self.at + LOCAL + self.name.len() as u64
    }

    /// Its fields in both places of a ZIP file: version, flags, no compression, 1 January 1980, checksum, sizes, length of the name.
    fn about(&self) -> Vec<u8> {
        let size = (self.size as u32).to_le_bytes();
        let mut about = Vec::with_capacity(26);
        about.extend([20, 0, 0, 0, 0, 0, 0, 0, 0x21, 0]);
        about.extend(self.checksum.clone().finalize().to_le_bytes());
        about.extend(size);
        about.extend(size);
        about.extend((self.name.len() as u16).to_le_bytes());
        about.extend([0, 0]);
        about
    }
}

impl Archive {
    fn append(&mut self, place: usize, bytes: &[u8]) -> anyhow::Result<()> {
        let entry = &mut self.entries[place];
        let at = entry.begin() + entry.written;
        entry.written += bytes.len() as u64;
        entry.checksum.update(bytes);
        self.write_at(at, bytes)
    }

    fn write_at(&mut self, at: u64, bytes: &[u8]) -> anyhow::Result<()> {
        let sought = self.file.seek(SeekFrom::Start(at));
        let written = sought.and_then(|_| self.file.write_all(bytes));
        written.with_context(|| format!("cannot write {}", self.path.display()))
    }

    /// Writes the header of each array, and the list at the end.
    fn close(mut self) -> anyhow::Result<(PathBuf, Growing)> {
        let mut list = Vec::new();
        let mut end = 0;
        for place in 0..self.entries.len() {
            let entry = &self.entries[place];
            if entry.written != entry.size {
                bail!("{} has {} bytes of {}", entry.name, entry.written, entry.size);
            }
            let (about, name) = (entry.about(), entry.name.clone().into_bytes());
            list.extend(b"PK\x01\x02\x14\x00");
            list.extend(&about);
            // No comment, first disk, no attributes.
            list.extend([0; 10]);
            list.extend((entry.at as u32).to_le_bytes());
            list.extend(&name);
            let at = entry.at;
            end = entry.begin() + entry.size;
            self.write_at(at, &[&b"PK\x03\x04"[..], &about, &name].concat())?;
        }
        let entries = (self.entries.len() as u16).to_le_bytes();
        let length = (list.len() as u32).to_le_bytes();
        list.extend(b"PK\x05\x06\0\0\0\0");
        list.extend(entries);
        list.extend(entries);
        list.extend(length);
        list.extend((end as u32).to_le_bytes());
        list.extend([0, 0]);
        self.write_at(end, &list)?;
        Ok((self.path, self.file))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrices_are_written_as_numpy_reads_them() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("matrix.npy");
        write_matrix(&path, &[1.5f32, -2.0, 0.0, 4.0, 5.0, 6.0], 3, 2).expect("a file");
        let bytes = std::fs::read(&path).expect("a file");
        let (header, numbers) = bytes.split_at(128);
        assert_eq!(header[..10], *b"\x93NUMPY\x01\x00\x76\x00");
        let about = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }";
        let text = std::str::from_utf8(&header[10..]).expect("plain text");
        assert_eq!(text.trim_end(), about);
        assert!(text.ends_with('\n'));
        assert_eq!(numbers.len(), 24);
        assert_eq!(numbers[..8], [0, 0, 0xc0, 0x3f, 0, 0, 0, 0xc0]);
    }

    #[test]
    fn one_side_has_its_comma_and_the_longest_shape_has_room() {
        let text = |shape: &[u64]| String::from_utf8(header("|b1", shape)[10..].into()).expect("plain text");
        assert!(text(&[7]).contains("'shape': (7,), }"));
        assert!(text(&[u64::MAX, 8192, 8192]).contains("(18446744073709551615, 8192, 8192), }"));
    }

    fn arrays() -> [Array; 2] {
        [("bytes", "|u1", vec![4, 3]), ("floats", "<f4", vec![4])].map(|(name, kind, shape)| Array { name, kind, shape })
    }

    fn grow(arrays: &mut Arrays) {
        for k in 0..4u8 {
            arrays.append(0, &[k; 3]).expect("room");
            arrays.append(1, &f32::from(k).to_le_bytes()).expect("room");
        }
    }

    #[test]
    fn arrays_grow_side_by_side_and_are_the_same_in_a_folder_and_an_archive() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("both.npz");
        let mut separate = Arrays::in_folder(folder.path(), &arrays()).expect("files");
        let mut archive = Arrays::in_archive(&path, &arrays()).expect("a file");
        grow(&mut separate);
        grow(&mut archive);
        for arrays in [separate, archive] {
            files::keep_new(arrays.close().expect("complete")).expect("kept");
        }
        let archive = std::fs::read(&path).expect("there");
        assert_eq!(archive.len() as u64, archive_size(&arrays()));
        for array in arrays() {
            let alone = std::fs::read(folder.path().join(array.file())).expect("there");
            assert_eq!(alone.len() as u64, array.size());
            let places = archive.windows(alone.len()).filter(|window| *window == alone);
            assert_eq!(places.count(), 1, "{}", array.name);
        }
    }

    #[test]
    fn what_is_not_kept_leaves_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("both.npz");
        let half = Arrays::in_archive(&path, &arrays()).expect("a file");
        assert!(
            half.close()
                .err()
                .expect("half")
                .to_string()
                .contains("bytes.npy has 128 bytes of 140")
        );
        let mut dropped = Arrays::in_folder(folder.path(), &arrays()).expect("files");
        grow(&mut dropped);
        drop(dropped);
        assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 0);
    }

    #[test]
    fn an_archive_that_is_too_large_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let large = [Array {
            name: "large",
            kind: "<f4",
            shape: vec![1 << 30],
        }];
        let refused = Arrays::in_archive(&folder.path().join("large.npz"), &large).err().expect("refused");
        assert!(refused.to_string().contains("give a folder"), "{refused}");
    }
}
