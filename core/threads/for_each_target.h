#pragma once

/// Before a function with a plain loop: it is compiled for several instruction sets, and the
/// processor that it runs on chooses. Results are the same bits on all of them, because nothing is
/// contracted (-ffp-contract=off) and sums are not reordered.
/// Sanitizers and other processors get the plain version.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define SCARP_FOR_EACH_TARGET \
  __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define SCARP_FOR_EACH_TARGET
#endif
