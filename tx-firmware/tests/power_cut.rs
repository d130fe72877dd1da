//! The power is cut at every single operation of the flash memory, and what was stored is still there.

mod flash;

use fixed::types::{U1F31, U12F20, U32F32};
use flash::{ERASE, Flash, Power};
use link::l2a_table::{ILLUMINANCES_MAX, INTERVALS_MAX, Interval, L2aTable};
use tx_firmware::calibration::{Calibration, Measured};
use tx_firmware::store::{Memory, Store, StoreError};

const PLACE: core::ops::Range<u32> = 0..2 * ERASE as u32;

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
        shortest_pulse_ns: 100,
        pwm_period_ns: 20_000,
        reflectance: U1F31::lit("0.4"),
        interval: Interval::lit("1"),
        sensor_gain: U12F20::lit("1"),
        low_current_share: U1F31::ONE,
    })
    .expect("a calibration")
}

fn store<const WRITE: usize>(flash: Flash<WRITE>) -> Store<Flash<WRITE>> {
    Store::new(flash, PLACE).expect("a store")
}

/// A memory to which `updates` tables have been saved, and one calibration before them.
fn used<const WRITE: usize>(updates: u16) -> Flash<WRITE> {
    let mut store = store(Flash::new());
    store.save_calibration(&calibration(1)).expect("room");
    for number in 0..updates {
        store.save_table(&table(number)).expect("room");
    }
    store.release()
}

/// Cuts the power at each operation of the update that follows `updates` others, torn in several ways. Returns how
/// many cuts there were.
fn cut_everywhere<const WRITE: usize>(updates: u16) -> u64 {
    let before = used::<WRITE>(updates);
    let (old, new) = (table(updates - 1), table(updates));
    let mut cuts = 0;
    for tear in 0..6 {
        for operations in 0.. {
            let mut cut = store(Flash {
                power: Power::For(operations),
                tear,
                ..before.clone()
            });
            let saved = cut.save_table(&new);
            let flash = cut.release().restarted();
            let mut restarted = store(flash.clone());
            let found = restarted.table().expect("readable").expect("a table");
            let context =
                format!("{WRITE}-byte words, update {updates}, tear {tear}, cut at {operations}");
            if saved.is_ok() {
                assert_eq!(found, new, "{context}");
                break;
            }
            cuts += 1;
            assert!(found == old || found == new, "neither table: {context}");
            assert_eq!(
                restarted.calibration(),
                Ok(Some(calibration(1))),
                "{context}"
            );
            cuts += cut_repair_everywhere(&flash, &old, &new, &context);
            // It goes on working: the update is tried again, and holds.
            restarted.save_table(&new).expect("saved after the restart");
            assert_eq!(restarted.table(), Ok(Some(new.clone())), "{context}");
        }
    }
    cuts
}

/// Cuts the power at each operation with which a restarted transmitter mends what the first cut left.
fn cut_repair_everywhere<const WRITE: usize>(
    left: &Flash<WRITE>,
    old: &L2aTable,
    new: &L2aTable,
    context: &str,
) -> u64 {
    for operations in 0.. {
        let mut cut = store(Flash {
            power: Power::For(operations),
            ..left.clone()
        });
        let read = cut.table();
        let found = store(cut.release().restarted()).table();
        let found = found.expect("readable").expect("a table");
        assert!(
            found == *old || found == *new,
            "{context}, repair cut at {operations}"
        );
        if read.is_ok() {
            return operations;
        }
    }
    unreachable!()
}

#[test]
fn a_power_cut_at_any_operation_leaves_the_old_table_or_the_new() {
    // The first updates fill a unit; later ones move what is needed to the other unit and erase the first.
    for updates in [1, 2, 9, 10, 11, 12, 13, 20, 21, 22, 23] {
        assert!(cut_everywhere::<4>(updates) > 0);
    }
}

#[test]
fn it_does_so_whatever_the_flashs_words_are() {
    for updates in [11, 12] {
        assert!(cut_everywhere::<1>(updates) > 0);
        assert!(cut_everywhere::<8>(updates) > 0);
        assert!(cut_everywhere::<32>(updates) > 0);
    }
}

#[test]
fn erased_and_foreign_memories_hold_nothing_and_can_be_used() {
    let mut erased = store(Flash::<4>::new());
    assert_eq!(erased.table(), Ok(None));
    assert_eq!(erased.calibration(), Ok(None));
    for fill in [0x00, 0x55, 0xa5] {
        let mut flash = Flash::<4>::new();
        flash.bytes.fill(fill);
        let mut foreign = store(flash);
        assert!(!matches!(foreign.table(), Ok(Some(_))));
        foreign.save_table(&table(1)).expect("taken over");
        assert_eq!(foreign.table(), Ok(Some(table(1))));
    }
}

#[test]
fn a_place_must_be_whole_units_and_two_of_them() {
    for (start, end) in [(0, ERASE), (100, 3 * ERASE), (0, 2 * ERASE + 1), (ERASE, 0)] {
        let (start, end) = (start as u32, end as u32);
        let refused = Store::new(Flash::<4>::new(), start..end).err();
        assert_eq!(refused, Some(StoreError::Addresses { start, end }));
    }
}
