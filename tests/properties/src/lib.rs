//! Property tests whose cases are the same in each run and on each machine: what fails in the gate fails at home.
//!
//! [`properties!`] is `proptest!` with seeds made of the tests' names. `VOCC_EXPLORE=SEED` draws other cases; what fails then becomes a
//! regression case in a file beside the sources, which each later run replays. `tests/tools/explore` does so for some minutes.

use std::any::Any;
use std::fmt::Debug;
use std::path::Path;

use proptest::test_runner::{Config, FailurePersistence, FileFailurePersistence, PersistedSeed, RngSeed};

#[doc(hidden)]
pub use proptest;

/// The imports of a file with properties.
pub mod prelude {
    pub use crate::properties;
    pub use proptest::prelude::{
        Arbitrary, BoxedStrategy, Just, Strategy, TestCaseError, any, prop, prop_assert, prop_assert_eq, prop_assert_ne, prop_assume,
        prop_compose, prop_oneof,
    };
}

/// The variable whose number draws other cases than the gate's.
const EXPLORE: &str = "VOCC_EXPLORE";
/// The name of the files of regression cases.
const REGRESSIONS: &str = "proptest-regressions";

/// As `proptest!`, with a fixed seed for each test. `#![cases(24)]` sets how many cases each test of the block tries instead of 256.
#[macro_export]
macro_rules! properties {
    (
        #![cases($cases:expr)]
        $($(#[$meta:meta])* fn $name:ident($($argument:tt)+) $body:block)*
    ) => {
        $($crate::proptest::proptest! {
            #![proptest_config($crate::config(concat!(module_path!(), "::", stringify!($name)), Some($cases)))]
            $(#[$meta])*
            fn $name($($argument)+) $body
        })*
    };
    ($($(#[$meta:meta])* fn $name:ident($($argument:tt)+) $body:block)*) => {
        $($crate::proptest::proptest! {
            #![proptest_config($crate::config(concat!(module_path!(), "::", stringify!($name)), None))]
            $(#[$meta])*
            fn $name($($argument)+) $body
        })*
    };
}

/// Whether a test runs all its cases, however long that takes: if `VOCC_TEST_CASES` is `all`.
pub fn all_cases() -> bool {
    std::env::var_os("VOCC_TEST_CASES").is_some_and(|cases| cases == "all")
}

/// The number of cases of a slow test: `few` in the gate, `all` on demand.
pub fn cases(few: u32, all: u32) -> u32 {
    if all_cases() { all } else { few }
}

/// The configuration that [`properties!`] gives proptest for the test with that name.
#[doc(hidden)]
pub fn config(name: &str, cases: Option<u32>) -> Config {
    let mut config = Config {
        rng_seed: RngSeed::Fixed(seed(name, exploration())),
        failure_persistence: Some(Box::new(Regressions)),
        ..Config::default()
    };
    if let Some(cases) = cases {
        config.cases = cases;
    }
    config
}

fn exploration() -> Option<u64> {
    let seed = std::env::var(EXPLORE).ok()?;
    Some(
        seed.parse()
            .unwrap_or_else(|_| panic!("{EXPLORE} is a number from 0 to {}, not '{seed}'", u64::MAX)),
    )
}

/// FNV-1a of the name and of the exploration's seed.
fn seed(name: &str, exploration: Option<u64>) -> u64 {
    let explored = exploration.map(u64::to_le_bytes).into_iter().flatten();
    name.bytes().chain(explored).fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

/// The files of regression cases: each run replays them, explorations alone write them.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Regressions;

/// Beside the folder `src`, or beside a test that is in none.
fn file(source: Option<&str>) -> FileFailurePersistence {
    let in_src = source.is_some_and(|source| Path::new(source).components().any(|part| part.as_os_str() == "src"));
    if in_src {
        FileFailurePersistence::SourceParallel(REGRESSIONS)
    } else {
        FileFailurePersistence::WithSource(REGRESSIONS)
    }
}

impl FailurePersistence for Regressions {
    fn load_persisted_failures2(&self, source: Option<&'static str>) -> Vec<PersistedSeed> {
        file(source).load_persisted_failures2(source)
    }

    fn save_persisted_failure2(&mut self, source: Option<&'static str>, seed: PersistedSeed, shrunk: &dyn Debug) {
        if exploration().is_some() {
            file(source).save_persisted_failure2(source, seed, shrunk);
        }
    }

    fn box_clone(&self) -> Box<dyn FailurePersistence> {
        Box::new(*self)
    }

    fn eq(&self, other: &dyn FailurePersistence) -> bool {
        other.as_any().is::<Self>()
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::PathBuf;
    use std::sync::Mutex;

    use super::*;

    static DRAWN: Mutex<Vec<u64>> = Mutex::new(Vec::new());

    properties! {
        #![cases(3)]
        fn draw(number: u64) {
            DRAWN.lock().unwrap().push(number);
        }
    }

    #[test]
    fn each_run_draws_the_same_cases() {
        draw();
        draw();
        let drawn = DRAWN.lock().unwrap();
        assert_eq!(drawn.len(), 6);
        assert_eq!(drawn[..3], drawn[3..]);
    }

    #[test]
    fn seeds_are_those_of_fnv_1a_and_differ_by_name_and_exploration() {
        // From the authors' test vectors.
        assert_eq!(seed("foobar", None), 0x8594_4171_f739_67e8);
        assert_ne!(seed("foobar", None), seed("foobar", Some(0)));
        assert_ne!(seed("foobar", Some(1)), seed("foobar", Some(2)));
    }

    fn sources(folder: &Path, to: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
            if path.is_dir() && !path.is_symlink() && !name.starts_with('.') && !["target", "node_modules"].contains(&name) {
                sources(&path, to);
            } else if name.ends_with(".rs") {
                to.push(path);
            }
        }
    }

    #[test]
    fn no_test_draws_from_other_seeds() {
        let here = Path::new(env!("CARGO_MANIFEST_DIR"));
        let root = here.ancestors().find(|folder| folder.join("Cargo.lock").exists()).unwrap();
        let mut files = Vec::new();
        sources(root, &mut files);
        for path in files.iter().filter(|path| !path.starts_with(here)) {
            let text = fs::read_to_string(path).unwrap();
            assert!(
                !text.contains("proptest::") && !text.contains("proptest!"),
                "{}: `properties!` has fixed seeds",
                path.display()
            );
        }
    }
}
