//! The power is cut at every single operation of the flash memory, and what was stored is still there.

mod flash;

use fixed::types::U32F32;
use flash::{ERASE, Flash, Power, Tear, mixed};
use link::checksum::crc32c;
use link::intensity::IntensityLimit;
use link::l2a_table::{ILLUMINANCES_MAX, INTERVALS_MAX, L2aTable};
use link::serial::Faults;
use link::symbol_rate::SymbolRate;
use link::waveform::{SymbolTiming, Waveform};
use properties::all_cases;
use tx_firmware::calibration::{BENCH, Calibration, Measured};
use tx_firmware::matrix::RecordingMatrix;
use tx_firmware::store::{Memory, Remembered, Store, StoreError};

const PLACE: core::ops::Range<u32> = 0..2 * ERASE as u32;
/// Bytes of a record, of which each save writes one.
const RECORD: usize = 1024;
/// Records of an erase unit.
const UNIT_RECORDS: u16 = (ERASE / RECORD) as u16;

/// A table of the largest size, another one for each number.
fn table(number: u16) -> L2aTable {
    let illuminances: [f32; ILLUMINANCES_MAX] = core::array::from_fn(|n| 2.5_f32.powi(n as i32));
    let intervals: [f32; INTERVALS_MAX] = core::array::from_fn(|n| 0.5 + 0.25 * n as f32);
    let values: Vec<f32> = (0..ILLUMINANCES_MAX * INTERVALS_MAX)
        .map(|n| 0.2 + (n * 7 + usize::from(number) * 13) as f32 % 3.8)
        .collect();
    L2aTable::new(&illuminances, &intervals, &values).expect("a table")
}

fn calibration(number: u32) -> Calibration {
    Calibration::new(Measured {
        luminance_full_cd_m2: U32F32::from_num(8000 + number),
        ..BENCH
    })
    .expect("a calibration")
}

fn store<const WRITE: usize>(flash: Flash<WRITE>) -> Store<Flash<WRITE>> {
    Store::new(flash, PLACE).expect("a store")
}

/// Still panels and carriers in turn.
fn timing(number: u16) -> SymbolTiming {
    let rate = SymbolRate::from_millihertz(90_000 + u32::from(number)).expect("a rate");
    let waveform = Waveform::new([0, 16, 0, 33, 5][usize::from(number) % 5]).expect("a carrier");
    SymbolTiming::new(rate, waveform).expect("a carrier that can be latched")
}

/// A stored value that changes: its values by number, and how to save and load it.
trait Storable: Sized + PartialEq + std::fmt::Debug {
    fn numbered(number: u16) -> Self;
    fn save<const WRITE: usize>(&self, store: &mut Store<Flash<WRITE>>) -> Result<(), StoreError>;
    fn load<const WRITE: usize>(store: &mut Store<Flash<WRITE>>) -> Result<Option<Self>, StoreError>;
}

impl Storable for L2aTable {
    fn numbered(number: u16) -> Self {
        table(number)
    }

    fn save<const WRITE: usize>(&self, store: &mut Store<Flash<WRITE>>) -> Result<(), StoreError> {
        store.save_table(self)
    }

    fn load<const WRITE: usize>(store: &mut Store<Flash<WRITE>>) -> Result<Option<Self>, StoreError> {
        store.table()
    }
}

impl Storable for SymbolTiming {
    fn numbered(number: u16) -> Self {
        timing(number)
    }

    fn save<const WRITE: usize>(&self, store: &mut Store<Flash<WRITE>>) -> Result<(), StoreError> {
        store.save_timing(*self)
    }

    fn load<const WRITE: usize>(store: &mut Store<Flash<WRITE>>) -> Result<Option<Self>, StoreError> {
        store.timing()
    }
}

impl Storable for IntensityLimit {
    fn numbered(number: u16) -> Self {
        Self::new(Some(1000 + u32::from(number)), 30_000).expect("a limit")
    }

    fn save<const WRITE: usize>(&self, store: &mut Store<Flash<WRITE>>) -> Result<(), StoreError> {
        store.save_intensity_limit(Some(*self))
    }

    fn load<const WRITE: usize>(store: &mut Store<Flash<WRITE>>) -> Result<Option<Self>, StoreError> {
        store.intensity_limit()
    }
}

/// A memory to which one calibration has been saved, `tables` tables and then `rates` symbol rates.
fn used<const WRITE: usize>(tables: u16, rates: u16) -> Flash<WRITE> {
    let mut store = store(Flash::new());
    store.save_calibration(&calibration(1)).expect("room");
    for number in 0..tables {
        store.save_table(&table(number)).expect("room");
    }
    for number in 0..rates {
        store.save_timing(timing(number)).expect("room");
    }
    store.release()
}

/// Cuts the power at each operation of the save of the value with this number, torn in several ways, in a memory that holds the one before.
/// Returns how many cuts there were.
fn cut_everywhere<const WRITE: usize, K: Storable>(before: &Flash<WRITE>, number: u16) -> u64 {
    let (old, new) = (K::numbered(number - 1), K::numbered(number));
    let mut cuts = 0;
    for tear in (0..6).map(Tear::Bits) {
        for operations in 0.. {
            let mut cut = store(Flash {
                power: Power::For(operations),
                tear,
                ..before.clone()
            });
            let saved = new.save(&mut cut);
            let flash = cut.release().restarted();
            let mut restarted = store(flash.clone());
            let found = K::load(&mut restarted).expect("readable").expect("a value");
            let context = format!("{WRITE}-byte words, update {number}, {tear:?}, cut at {operations}");
            if saved.is_ok() {
                assert_eq!(found, new, "{context}");
                break;
            }
            cuts += 1;
            assert!(found == old || found == new, "neither: {context}");
            assert_eq!(restarted.calibration(), Ok(Some(calibration(1))), "{context}");
            cuts += cut_repair_everywhere(&flash, &old, &new, &context);
            // It goes on working: the update is tried again, and holds.
            new.save(&mut restarted).expect("saved after the restart");
            assert_eq!(K::load(&mut restarted).as_ref(), Ok(&Some(K::numbered(number))), "{context}");
        }
    }
    cuts
}

/// Cuts the power at each operation with which a restarted transmitter mends what the first cut left.
fn cut_repair_everywhere<const WRITE: usize, K: Storable>(left: &Flash<WRITE>, old: &K, new: &K, context: &str) -> u64 {
    for operations in 0.. {
        let mut cut = store(Flash {
            power: Power::For(operations),
            ..left.clone()
        });
        let read = K::load(&mut cut);
        let found = K::load(&mut store(cut.release().restarted()));
        let found = found.expect("readable").expect("a value");
        assert!(found == *old || found == *new, "{context}, repair cut at {operations}");
        if read.is_ok() {
            return operations;
        }
    }
    unreachable!()
}

/// The bytes that a save writes, and whether it erases a unit before.
fn written<const WRITE: usize>(before: &Flash<WRITE>, save: impl Fn(&mut Store<Flash<WRITE>>) -> Result<(), StoreError>) -> (usize, bool) {
    let mut store = store(Flash {
        operations: 0,
        erased: 0,
        ..before.restarted()
    });
    save(&mut store).expect("with power");
    let flash = store.release();
    ((flash.operations - flash.erased) as usize * WRITE, flash.erased > 0)
}

#[test]
fn a_save_writes_one_record_and_erases_the_next_unit_if_this_one_is_full() {
    for records in 1..=3 * UNIT_RECORDS {
        // One of the records is the calibration's.
        let number = records - 1;
        let is_full = records.is_multiple_of(UNIT_RECORDS);
        let save = written(&used::<4>(number, 0), |store| store.save_table(&table(number)));
        assert_eq!(save, (RECORD, is_full), "after {records} records");
    }
}

#[test]
fn a_power_cut_at_any_operation_leaves_the_old_table_or_the_new() {
    // With the calibration's record, 3, 7 and 11 tables fill a unit, and the next save erases the other one.
    for updates in [1, 2, 3, 4, 6, 7, 8, 10, 11, 12] {
        let before = used::<4>(updates, 0);
        assert!(cut_everywhere::<4, L2aTable>(&before, updates) > 0);
    }
}

#[test]
fn a_power_cut_at_any_operation_leaves_the_old_symbol_rate_and_carrier_or_the_new_and_the_table() {
    // A unit is full after 4, 8 and 12 records: of one calibration, the tables and the rates.
    for (tables, rates) in [(1, 1), (1, 2), (1, 3), (5, 1), (5, 2), (5, 3), (5, 6)] {
        let before = used::<4>(tables, rates);
        assert!(cut_everywhere::<4, SymbolTiming>(&before, rates) > 0);
        let mut store = store(before);
        store.save_timing(timing(rates)).expect("room");
        assert_eq!(store.table(), Ok(Some(table(tables - 1))));
    }
}

#[test]
fn a_power_cut_at_any_operation_leaves_the_old_intensity_limit_or_the_new() {
    // With one calibration, one rate and the limit before, 1 and 5 tables fill a unit.
    for tables in [1, 2, 4, 5, 6] {
        let mut store = store(used::<4>(tables, 1));
        let before = IntensityLimit::numbered(0);
        store.save_intensity_limit(Some(before)).expect("room");
        assert!(cut_everywhere::<4, IntensityLimit>(&store.release(), 1) > 0);
    }
}

#[test]
fn a_limit_is_remembered_whatever_calibration_is_there_and_can_be_taken_back() {
    let mut store = store(Flash::<4>::new());
    let limit = IntensityLimit::numbered(7);
    store.save_intensity_limit(Some(limit)).expect("room");
    let found = store.remembered::<RecordingMatrix>(calibration(1)).calibration;
    assert_eq!(found, calibration(1).limited_to(Some(limit)));
    store.save_calibration(&calibration(2)).expect("room");
    let found = store.remembered::<RecordingMatrix>(calibration(1)).calibration;
    assert_eq!(found, calibration(2).limited_to(Some(limit)));
    store.save_intensity_limit(None).expect("room");
    let found = store.remembered::<RecordingMatrix>(calibration(1)).calibration;
    assert_eq!(found, calibration(2));
}

#[test]
fn it_does_so_whatever_the_flashs_words_are() {
    // With the calibration's record, 7 tables fill a unit, and so do 3 tables with 4 rates.
    for updates in [6, 7] {
        assert!(cut_everywhere::<1, L2aTable>(&used(updates, 0), updates) > 0);
        assert!(cut_everywhere::<8, L2aTable>(&used(updates, 0), updates) > 0);
        assert!(cut_everywhere::<32, L2aTable>(&used(updates, 0), updates) > 0);
        assert!(cut_everywhere::<32, SymbolTiming>(&used(3, updates - 3), updates - 3) > 0);
    }
}

/// The contents of the store, as a transmitter finds them when it starts.
#[derive(Clone, Debug, Default, PartialEq)]
struct StoreContents {
    table: Option<L2aTable>,
    calibration: Option<Calibration>,
    timing: Option<SymbolTiming>,
    limit: Option<IntensityLimit>,
}

/// One of the values of [`StoreContents`].
enum Value {
    Table(Box<L2aTable>),
    Calibration(Calibration),
    Timing(SymbolTiming),
    Limit(IntensityLimit),
}

impl Value {
    /// Tables of all sizes, and now and then something else.
    fn drawn(seed: u64) -> Self {
        let number = mixed(seed);
        match number >> 60 {
            0 => Self::Calibration(calibration(number as u32 % 10_000)),
            1 => Self::Timing(timing(number as u16 % 500)),
            2 => Self::Limit(IntensityLimit::numbered(number as u16)),
            _ => {
                let (n, m) = (
                    (number >> 20) as usize % ILLUMINANCES_MAX + 1,
                    (number >> 40) as usize % INTERVALS_MAX + 1,
                );
                let lux: Vec<f32> = (0..n).map(|n| 2.5_f32.powi(n as i32)).collect();
                let pitches: Vec<f32> = (0..m).map(|n| 0.5 + 0.25 * n as f32).collect();
                let values: Vec<f32> = (0..n * m).map(|n| 0.2 + (n as u64 * 7 + number % 997) as f32 % 3.8).collect();
                Self::Table(Box::new(L2aTable::new(&lux, &pitches, &values).expect("a table")))
            }
        }
    }

    fn save<const WRITE: usize>(&self, store: &mut Store<Flash<WRITE>>) -> Result<(), StoreError> {
        match self {
            Self::Table(table) => store.save_table(table),
            Self::Calibration(calibration) => store.save_calibration(calibration),
            Self::Timing(timing) => store.save_timing(*timing),
            Self::Limit(limit) => store.save_intensity_limit(Some(*limit)),
        }
    }
}

impl StoreContents {
    fn found<const WRITE: usize>(flash: &Flash<WRITE>) -> Self {
        let mut store = store(flash.restarted());
        Self {
            table: store.table().ok().flatten(),
            calibration: store.calibration().ok().flatten(),
            timing: store.timing().ok().flatten(),
            limit: store.intensity_limit().ok().flatten(),
        }
    }

    fn with(&self, value: &Value) -> Self {
        let mut kept = self.clone();
        match value {
            Value::Table(table) => kept.table = Some(*table.clone()),
            Value::Calibration(calibration) => kept.calibration = Some(*calibration),
            Value::Timing(timing) => kept.timing = Some(*timing),
            Value::Limit(limit) => kept.limit = Some(*limit),
        }
        kept
    }
}

/// Saves a value and cuts the power after `bytes` bytes, if it takes that many: the flash, and what a restart finds in it.
fn cut_after<const WRITE: usize>(flash: &Flash<WRITE>, value: &Value, bytes: usize) -> (Flash<WRITE>, StoreContents) {
    let before = StoreContents::found(flash);
    let mut cut = store(Flash {
        power: Power::For((bytes / WRITE) as u64),
        tear: Tear::Bytes(bytes % WRITE),
        ..flash.clone()
    });
    let saved = value.save(&mut cut).is_ok();
    let left = cut.release().restarted();
    let found = StoreContents::found(&left);
    let with = before.with(value);
    assert!(
        found == with || !saved && found == before,
        "{WRITE}-byte words, cut after {bytes} bytes"
    );
    (left, found)
}

/// Where the power is cut in a save, in bytes: an erase before the record counts as one word.
fn cuts(erase: usize, drawn: impl Fn(u64) -> usize) -> Vec<usize> {
    let end = erase + RECORD;
    if all_cases() {
        return (0..=end + 8).collect();
    }
    // The format and the sequence number; the checksum, the end and beyond; anywhere.
    let first = [0, 1, 2, 5].map(|byte| erase + byte);
    [0].into_iter()
        .chain(first)
        .chain(end - 4..=end + 1)
        .chain((0..3).map(drawn))
        .collect()
}

/// A fixed sequence of saves, each of which is cut at many bytes; then comes the next, which is cut once more or not, and is tried until it
/// is through. What was answered with success is there after the next restart.
fn sequence_of_cuts<const WRITE: usize>(sequence: u64) {
    const SAVES: u64 = 4;
    let mut flash = Flash::<WRITE>::new();
    let value = |save: u64| Value::drawn(sequence * 100 + save);
    for save in 0..SAVES {
        let drawn = |number: u64| mixed(sequence << 20 | save << 16 | number) as usize % (WRITE + RECORD);
        let (bytes, erases) = written(&flash, |store| value(save).save(store));
        assert_eq!(bytes, RECORD);
        for bytes in cuts(if erases { WRITE } else { 0 }, drawn) {
            let (mut left, mut found) = cut_after(&flash, &value(save), bytes);
            let next = value(save + 1);
            if drawn(bytes as u64 + 10).is_multiple_of(3) {
                (left, found) = cut_after(&left, &next, drawn(bytes as u64 + 11));
            }
            let mut last = store(left);
            next.save(&mut last).expect("with power");
            let context = format!("{WRITE}-byte words, sequence {sequence}, save {save} cut after {bytes} bytes");
            assert_eq!(StoreContents::found(&last.release()), found.with(&next), "{context}");
        }
        let mut whole = store(flash);
        value(save).save(&mut whole).expect("with power");
        flash = whole.release();
    }
}

/// All cuts with `VOCC_TEST_CASES=all cargo test --release -p vocc-tx-firmware --test power_cut`.
#[test]
fn what_was_saved_is_there_whatever_was_cut_before_in_words_of_1_byte() {
    (0..200).for_each(sequence_of_cuts::<1>);
}

#[test]
fn what_was_saved_is_there_whatever_was_cut_before_in_words_of_4_bytes() {
    (0..200).for_each(sequence_of_cuts::<4>);
}

#[test]
fn what_was_saved_is_there_whatever_was_cut_before_in_words_of_32_bytes() {
    (0..200).for_each(sequence_of_cuts::<32>);
}

#[test]
fn erased_and_foreign_memories_hold_nothing_and_can_be_used() {
    let mut erased = store(Flash::<4>::new());
    assert_eq!(erased.table(), Ok(None));
    assert_eq!(erased.calibration(), Ok(None));
    assert_eq!(erased.timing(), Ok(None));
    assert_eq!(erased.intensity_limit(), Ok(None));
    let nothing = Remembered {
        calibration: calibration(1),
        table: L2aTable::shipped(),
        timing: SymbolTiming::CARRIER,
        faults: Faults::NO_TABLE.union(Faults::NO_CALIBRATION),
    };
    assert_eq!(erased.remembered::<RecordingMatrix>(calibration(1)), nothing);
    for fill in [0x00, 0x55, 0xa5] {
        let mut flash = Flash::<4>::new();
        flash.bytes.fill(fill);
        let mut foreign = store(flash);
        assert!(!matches!(foreign.table(), Ok(Some(_))));
        let found = foreign.remembered::<RecordingMatrix>(calibration(1));
        assert_eq!(found.table, L2aTable::shipped());
        assert_eq!(found.faults, nothing.faults.union(Faults::STORE));
        foreign.save_table(&table(1)).expect("taken over");
        assert_eq!(foreign.table(), Ok(Some(table(1))));
        let found = foreign.remembered::<RecordingMatrix>(calibration(1));
        assert_eq!((found.table, found.faults), (table(1), Faults::NO_CALIBRATION));
    }
}

/// An erase stops a board's processor, and its watchdog with it.
#[test]
fn a_save_erases_one_unit_at_most_whatever_was_in_the_memory() {
    let mut flash = Flash::<1>::new();
    flash.bytes.fill(0x5a);
    for number in 0..20 {
        let mut store = store(flash);
        store.save_table(&table(number)).expect("taken over");
        flash = store.release();
        assert!(core::mem::take(&mut flash.erased) <= 1, "{number}");
    }
}

#[test]
fn records_of_another_format_are_nothing_stored_and_are_written_over() {
    let mut flash = used::<4>(3, 1);
    for record in flash.bytes.chunks_exact_mut(RECORD).take_while(|record| record[0] != 0xff) {
        record[0] += 1;
        let (content, crc) = record.split_last_chunk_mut().expect("a record");
        *crc = crc32c(&[content]).to_le_bytes();
    }
    let mut store = store(flash);
    assert_eq!(store.table(), Ok(None));
    let found = store.remembered::<RecordingMatrix>(calibration(1));
    assert_eq!(found.faults, Faults::NO_TABLE.union(Faults::NO_CALIBRATION));
    store.save_timing(timing(7)).expect("room");
    let mut store = self::store(store.release());
    assert_eq!((store.timing(), store.table()), (Ok(Some(timing(7))), Ok(None)));
}

#[test]
fn a_place_must_be_whole_units_and_two_of_them() {
    for (start, end) in [(0, ERASE), (100, 3 * ERASE), (0, 2 * ERASE + 1), (ERASE, 0)] {
        let (start, end) = (start as u32, end as u32);
        let refused = Store::new(Flash::<4>::new(), start..end).err();
        assert_eq!(refused, Some(StoreError::Addresses { start, end }));
    }
}

#[test]
fn a_torn_record_that_reads_whole_again_is_older_than_what_was_saved_since() {
    /// The last byte of the fourth record, which is the first unit's last.
    const LAST: usize = 4 * RECORD - 1;
    let mut first = store(used::<1>(2, 0));
    first.save_table(&table(50)).expect("room");
    let mut flash = first.release();
    flash.bytes[LAST] ^= 1;
    let mut second = store(flash);
    second.save_table(&table(60)).expect("room");
    let mut flash = second.release();
    flash.bytes[LAST] ^= 1;
    assert_eq!(store(flash).table(), Ok(Some(table(60))));
}
