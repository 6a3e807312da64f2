//! Sets the C library's allocator for a training, so that the process keeps freed memory.
//!
//! Tensors of some megabytes are allocated and freed hundreds of times per step. By default, each is newly mapped and returned to
//! the system, which clears every page. With these settings, freed memory is kept for the next tensor.

/// Keeps freed memory from now on and in all threads. `n_threads` threads compute at a time. On systems without the GNU C
/// library, nothing happens.
pub(crate) fn keep_freed_memory(n_threads: usize) {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        /// Blocks up to this size come from the heap. 32 MiB is the largest value that the C library accepts on all systems.
        const MMAP_THRESHOLD: libc::c_int = 32 << 20;
        /// The heap is not shortened while less than this is free at its end.
        const TRIM_THRESHOLD: libc::c_int = 1 << 30;
        // Several threads would wait for each other at one arena. A single thread keeps memory best with one arena.
        let n_arenas = if n_threads == 1 {
            1
        } else {
            8 * libc::c_int::try_from(n_threads).unwrap_or(8)
        };
        #[allow(unsafe_code, reason = "mallopt has no safe form")]
        // SAFETY: mallopt changes numbers inside of the allocator under its own lock; a value that it does not accept changes
        // nothing.
        unsafe {
            libc::mallopt(libc::M_ARENA_MAX, n_arenas);
            libc::mallopt(libc::M_MMAP_THRESHOLD, MMAP_THRESHOLD);
            libc::mallopt(libc::M_TRIM_THRESHOLD, TRIM_THRESHOLD);
        }
    }
}
