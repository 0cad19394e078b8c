//! CPU mirror of compaction: a filter.

use gpu::{PrefixSum, StageTimer};

use super::Compaction;
use crate::store::{Bits, SurfelStore};
use crate::testing::gpu;

#[test]
fn compaction_is_a_stable_filter_of_every_array() {
    let gpu = gpu();
    let slots = 777u32;
    let store = SurfelStore::new(&gpu, 1024).unwrap();
    let kept = |slot: u32| slot.is_multiple_of(3) || slot.is_multiple_of(7);
    for (number, array) in (0..).zip(store.arrays()) {
        // bits that are no numbers must survive
        let rows: Vec<Bits> = (0..slots).map(|slot| [slot, 0x7fc0_0001, 0xffff_ffff, number]).collect();
        gpu.write(&array, 0, &rows).unwrap();
    }
    let states: Vec<Bits> = (0..slots).map(|slot| [slot, 0, 0, u32::from(slot % 3 == 0)]).collect();
    let held: Vec<Bits> = (0..slots).map(|slot| [slot, 0, 0, u32::from(slot % 7 == 0)]).collect();
    gpu.write(&store.history, 0, &states).unwrap();
    gpu.write(&store.held.rest, 0, &held).unwrap();
    let marked = PrefixSum::new(&gpu, 1024).unwrap();
    let timer = StageTimer::new(&gpu, 16).unwrap();
    let compaction = Compaction::new(&gpu, &store, &marked).unwrap();
    let left = compaction.run(&gpu, &timer, &marked, slots).unwrap();
    let expected: Vec<u32> = (0..slots).filter(|&slot| kept(slot)).collect();
    assert_eq!(left as usize, expected.len());
    for array in store.arrays() {
        let rows = gpu.read_range(&array, 0, slots as usize).unwrap();
        let ids: Vec<u32> = rows[..left as usize].iter().map(|row| row[0]).collect();
        assert_eq!(ids, expected);
        assert!(rows[left as usize..].iter().all(|row| *row == [0; 4]), "freed slots are zeroed");
    }
    let payload = gpu.read_range(&store.geometry.cast::<Bits>(), 0, left as usize).unwrap();
    assert!(payload.iter().all(|row| row[1..] == [0x7fc0_0001, 0xffff_ffff, 0]));
}
