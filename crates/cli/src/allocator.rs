//! Sets the C library's allocator for a training: nothing goes in, memory stays with the process.
//!
//! Tensors of some megabytes come and go hundreds of times a step. By default each is mapped anew and given back, and
//! the system clears every page in between; here freed memory is kept for the next tensor.

/// Keeps freed memory, from now on and in all threads, `n_threads` of which compute at a time. Elsewhere than on GNU
/// systems nothing happens.
pub(crate) fn keep_freed_memory(n_threads: usize) {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        /// Blocks up to this size come from the heap; 32 MiB is the most that the C library accepts everywhere.
        const MMAP_THRESHOLD: libc::c_int = 32 << 20;
        /// The heap is not shortened while less than this is free at its end.
        const TRIM_THRESHOLD: libc::c_int = 1 << 30;
        // Side by side, threads would wait for each other at one arena; alone, the first one keeps memory best.
        let n_arenas = if n_threads == 1 {
            1
        } else {
            8 * libc::c_int::try_from(n_threads).unwrap_or(8)
        };
        #[allow(unsafe_code, reason = "mallopt has no safe form")]
        // SAFETY: mallopt changes numbers inside of the allocator under its own lock; a value that it does not accept
        // leaves it as it was.
        unsafe {
            libc::mallopt(libc::M_ARENA_MAX, n_arenas);
            libc::mallopt(libc::M_MMAP_THRESHOLD, MMAP_THRESHOLD);
            libc::mallopt(libc::M_TRIM_THRESHOLD, TRIM_THRESHOLD);
        }
    }
}
