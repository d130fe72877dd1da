// A NOR flash memory in RAM, whose power can be cut at any written word and any erase.

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};

/// Bytes of the whole memory.
pub const CAPACITY: usize = 16 * 1024;
/// Bytes of one erase unit.
pub const ERASE: usize = 4096;

/// Words of `WRITE` bytes, erase units of [`ERASE`].
#[derive(Clone)]
pub struct Flash<const WRITE: usize> {
    /// The contents; an erased byte is 0xff.
    pub bytes: Vec<u8>,
    /// The remaining life of the power.
    pub power: Power,
    /// Number of words written and units erased.
    pub operations: u64,
    /// Number of units erased.
    pub erased: u64,
    /// The changed part of a torn word or unit.
    pub tear: Tear,
}

/// The changed part of a torn word or unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tear {
    /// No bit, all or some of them: a number decides which.
    Bits(u64),
    /// The first bytes.
    #[allow(dead_code, reason = "not every test cuts the power")]
    Bytes(usize),
}

/// The remaining life of the power.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Power {
    /// The power stays on.
    Stays,
    /// The power lasts for this many more words or units, and fails during the next one.
    #[allow(dead_code, reason = "not every test cuts the power")]
    For(u64),
    /// The power is off.
    Gone,
}

/// The power is off, or the memory is used wrongly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Failure(NorFlashErrorKind);

impl NorFlashError for Failure {
    fn kind(&self) -> NorFlashErrorKind {
        self.0
    }
}

impl<const WRITE: usize> Flash<WRITE> {
    /// An erased memory, with power.
    pub fn new() -> Self {
        Self {
            bytes: vec![0xff; CAPACITY],
            power: Power::Stays,
            operations: 0,
            erased: 0,
            tear: Tear::Bits(0),
        }
    }

    /// The memory after the power has been restored.
    #[allow(dead_code, reason = "not every test cuts the power")]
    pub fn restarted(&self) -> Self {
        Self {
            power: Power::Stays,
            ..self.clone()
        }
    }

    /// An operation on the unit or word from `from` on, which sets its bytes to `to`, completely or torn.
    fn operate(&mut self, from: usize, to: &[u8]) -> Result<(), Failure> {
        let torn = self.power == Power::For(0);
        self.operations += 1;
        for (index, &new) in to.iter().enumerate() {
            let byte = &mut self.bytes[from + index];
            let changed = if torn { self.tear.mask(index) } else { 0xff };
            *byte ^= (*byte ^ new) & changed;
        }
        self.power = match self.power {
            Power::Stays => Power::Stays,
            Power::For(left) => left.checked_sub(1).map_or(Power::Gone, Power::For),
            Power::Gone => Power::Gone,
        };
        self.powered()
    }

    fn powered(&self) -> Result<(), Failure> {
        match self.power {
            Power::Gone => Err(Failure(NorFlashErrorKind::Other)),
            Power::Stays | Power::For(_) => Ok(()),
        }
    }

    fn check(&self, from: u32, to: u32, unit: usize) -> Result<(), Failure> {
        self.powered()?;
        let (from, to) = (from as usize, to as usize);
        if from > to || to > CAPACITY {
            Err(Failure(NorFlashErrorKind::OutOfBounds))
        } else if !from.is_multiple_of(unit) || !to.is_multiple_of(unit) {
            Err(Failure(NorFlashErrorKind::NotAligned))
        } else {
            Ok(())
        }
    }
}

impl Tear {
    /// The changed bits of a byte.
    fn mask(self, index: usize) -> u8 {
        match self {
            Self::Bytes(bytes) if index < bytes => 0xff,
            Self::Bytes(_) => 0,
            Self::Bits(seed) => match seed % 4 {
                0 => 0,
                1 => 0xff,
                _ => (mixed(seed ^ index as u64) >> 56) as u8,
            },
        }
    }
}

/// A pseudorandom number.
pub fn mixed(seed: u64) -> u64 {
    let mixed = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9)
}

impl<const WRITE: usize> ErrorType for Flash<WRITE> {
    type Error = Failure;
}

impl<const WRITE: usize> ReadNorFlash for Flash<WRITE> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Failure> {
        let from = offset as usize;
        self.check(offset, offset + bytes.len() as u32, 1)?;
        bytes.copy_from_slice(&self.bytes[from..from + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        CAPACITY
    }
}

impl<const WRITE: usize> NorFlash for Flash<WRITE> {
    const WRITE_SIZE: usize = WRITE;
    const ERASE_SIZE: usize = ERASE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Failure> {
        self.check(from, to, ERASE)?;
        for unit in (from as usize..to as usize).step_by(ERASE) {
            self.erased += 1;
            self.operate(unit, &[0xff; ERASE])?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Failure> {
        self.check(offset, offset + bytes.len() as u32, WRITE)?;
        for (index, word) in bytes.chunks(WRITE).enumerate() {
            let from = offset as usize + index * WRITE;
            // Programming clears bits but sets none.
            let new: Vec<u8> = word.iter().zip(&self.bytes[from..]).map(|(new, old)| new & old).collect();
            self.operate(from, &new)?;
        }
        Ok(())
    }
}
