//! Sequential replacements of rayon's interfaces.

/// The error of a missing thread, which cannot occur.
#[derive(Debug, thiserror::Error)]
pub enum NoThread {}

/// The number of threads.
pub const fn threads() -> usize {
    1
}

/// Runs the work.
pub fn on_one_thread<T>(work: impl FnOnce() -> T) -> Result<T, NoThread> {
    Ok(work())
}

/// The used part of `rayon::prelude`.
pub mod prelude {
    /// As rayon's.
    pub trait IntoParallelIterator: IntoIterator + Sized {
        /// Sequential.
        fn into_par_iter(self) -> Self::IntoIter {
            self.into_iter()
        }
    }

    impl<I: IntoIterator> IntoParallelIterator for I {}

    /// As rayon's.
    pub trait ParallelSlice<T> {
        /// Sequential.
        fn par_iter(&self) -> std::slice::Iter<'_, T>;
    }

    impl<T> ParallelSlice<T> for [T] {
        fn par_iter(&self) -> std::slice::Iter<'_, T> {
            self.iter()
        }
    }

    /// As rayon's.
    pub trait ParallelIterator: Iterator + Sized {
        fn map_init<R, T>(self, room: impl FnOnce() -> R, mut work: impl FnMut(&mut R, Self::Item) -> T) -> impl Iterator<Item = T> {
            let mut room = room();
            self.map(move |item| work(&mut room, item))
        }
    }

    impl<I: Iterator> ParallelIterator for I {}
}
