//! Where Python enters: what pyo3's macros would write (see Cargo.toml on why they do not).

use crate::fill;
use pyo3::ffi;
use pyo3::prelude::*;
use std::cell::UnsafeCell;
use std::ptr::null_mut;

struct Definition(UnsafeCell<ffi::PyModuleDef>);

#[allow(unsafe_code)]
// SAFETY: only Python changes it, while it holds its lock.
unsafe impl Sync for Definition {}

static DEFINITION: Definition = Definition(UnsafeCell::new(ffi::PyModuleDef {
    m_base: ffi::PyModuleDef_HEAD_INIT,
    m_name: c"_native".as_ptr(),
    m_doc: c"The verbs' answers about records in memory.".as_ptr(),
    // It holds what is the whole process's, and is not made twice.
    m_size: -1,
    m_methods: null_mut(),
    m_slots: null_mut(),
    m_traverse: None,
    m_clear: None,
    m_free: None,
}));

/// Makes the module.
#[allow(unsafe_code, non_snake_case)]
#[unsafe(no_mangle)]
pub extern "C" fn PyInit__native() -> *mut ffi::PyObject {
    Python::attach(|py| {
        // SAFETY: Python calls this with its lock held; the definition is static and complete, and a module
        // made of it is owned, or null where an exception is set.
        let made =
            unsafe { Bound::from_owned_ptr_or_err(py, ffi::PyModule_Create(DEFINITION.0.get())) };
        let filled = made.and_then(|made| {
            let module = made.cast_into::<PyModule>()?;
            fill(&module)?;
            Ok(module.into_any())
        });
        match filled {
            Ok(module) => module.into_ptr(),
            Err(error) => {
                error.restore(py);
                null_mut()
            }
        }
    })
}
