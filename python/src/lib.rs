//! The module `tsumu._tsumu`: the library behind the Python package. In: bytes of columns, JSON and paths. Out: the same. The
//! package's Python files (`python/tsumu`) check arrays, name arguments and make numpy views of the bytes; nothing of the method
//! is here.

use pyo3::prelude::*;

mod bin;
mod catalog;
mod columns;
mod compare;
mod errors;
mod planned;
mod recognition;
mod run;
mod score;
mod site;
mod synthetic;
mod work;

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// The library behind the package `tsumu`.
#[pymodule]
mod _tsumu {
    #[pymodule_export]
    use crate::bin::Bin;
    #[pymodule_export]
    use crate::catalog::{Catalog, catalog_of, read_catalog};
    #[pymodule_export]
    use crate::compare::compare;
    #[pymodule_export]
    use crate::planned::Planned;
    #[pymodule_export]
    use crate::recognition::{Recognition, Segments};
    #[pymodule_export]
    use crate::run::{open_run, present, run, verify};
    #[pymodule_export]
    use crate::score::evaluate;
    #[pymodule_export]
    use crate::site::Site;
    #[pymodule_export]
    use crate::synthetic::{Recipe, read_recipe};
    #[pymodule_export]
    use crate::version;
}

/// The program's version, with its commit where it was built from one.
#[pyo3::pyfunction]
fn version() -> &'static str {
    tsumu::version::STAMP
}
