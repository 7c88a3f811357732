// Loops that are compiled twice and chosen once by what the processor offers: wider registers, the same
// additions in the same order, so the same bits. With PUNCTUM_NARROW_LOOPS defined only the narrow ones are
// compiled: to compare.
#pragma once

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__) && !defined(PUNCTUM_NARROW_LOOPS)
#define PUNCTUM_WIDE_LOOP __attribute__((target_clones("avx2", "default")))
#else
#define PUNCTUM_WIDE_LOOP
#endif
