//! The program in a file, as it is flashed.

use std::io;
use std::path::Path;

use object::LittleEndian;
use object::elf::{EM_ARM, FileHeader32, PT_LOAD, ProgramHeader32};
use object::read::elf::{FileHeader, ProgramHeader};
use sim::input;
use tx_firmware::program::ProgramHash;

/// The largest file, in bytes: most are debug information.
const FILE_MAX: u64 = 1 << 26;
/// The largest program, in bytes: the flash that an RP2040 can address.
const PROGRAM_MAX: usize = 1 << 24;

/// Why a file holds no program.
#[derive(Debug, thiserror::Error)]
pub enum ProgramFileError {
    #[error("cannot read it: {0}")]
    Read(#[from] io::Error),
    /// It is of another kind.
    #[error("it is not an ELF file for ARM: give the file that the build has made, such as vocc-pico, not a UF2 or BIN file made from it")]
    NoElf,
    /// Its segments are not in it.
    #[error("it is an ELF file that was damaged or cut short: build or download it again")]
    Damaged,
    /// It has nothing to flash.
    #[error("it is an ELF file without a program: give the linked program, not a library")]
    Empty,
    /// The flash between two segments is not defined.
    #[error("its parts do not follow one another in the flash: one ends at {end:#x}, and the next begins at {start:#x}")]
    Apart {
        /// The address after the first one.
        end: u64,
        /// The address of the next one.
        start: u64,
    },
    /// It is larger than any flash.
    #[error("its program has {bytes} bytes, and boards have room for {PROGRAM_MAX} at most: is it the file you meant?")]
    TooLong {
        /// Its bytes.
        bytes: usize,
    },
}

/// The hash of the program in an ELF file.
///
/// # Errors
/// See [`ProgramFileError`].
pub fn hash(path: &Path) -> Result<ProgramHash, ProgramFileError> {
    program(&input::read(path, FILE_MAX)?).map(|program| ProgramHash::of(&program))
}

/// The bytes that the flash holds, from the lowest address on.
fn program(file: &[u8]) -> Result<Vec<u8>, ProgramFileError> {
    let header = FileHeader32::<LittleEndian>::parse(file).map_err(|_| ProgramFileError::NoElf)?;
    let endian = header.endian().map_err(|_| ProgramFileError::NoElf)?;
    if header.e_machine(endian) != EM_ARM {
        return Err(ProgramFileError::NoElf);
    }
    let segments = header.program_headers(endian, file).map_err(|_| ProgramFileError::Damaged)?;
    let is_flashed = |segment: &&ProgramHeader32<LittleEndian>| segment.p_type(endian) == PT_LOAD && segment.p_filesz(endian) > 0;
    let mut segments: Vec<_> = segments.iter().filter(is_flashed).collect();
    segments.sort_by_key(|segment| segment.p_paddr(endian));
    let mut program = Vec::new();
    let mut end = None;
    for segment in segments {
        let start = u64::from(segment.p_paddr(endian));
        if let Some(end) = end.filter(|&end| end != start) {
            return Err(ProgramFileError::Apart { end, start });
        }
        let bytes = segment.data(endian, file).map_err(|()| ProgramFileError::Damaged)?;
        program.extend_from_slice(bytes);
        if program.len() > PROGRAM_MAX {
            return Err(ProgramFileError::TooLong { bytes: program.len() });
        }
        end = Some(start + bytes.len() as u64);
    }
    if program.is_empty() {
        Err(ProgramFileError::Empty)
    } else {
        Ok(program)
    }
}
