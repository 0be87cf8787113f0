/// One side of the comparison of trees: a process of its own that is told what to do and answers how long it took.
/// Memory is then its own, and no two libraries of GL ever meet.
#pragma once

#include <malloc.h>
#include <time.h>

#include <cstdint>
#include <cstdio>
#include <cstring>

namespace tessera::bench {

class TreeSide {
public:
    TreeSide() = default;
    virtual ~TreeSide() = default;
    TreeSide(const TreeSide&) = delete;
    TreeSide& operator=(const TreeSide&) = delete;

    /// Not timed.
    virtual void clear() = 0;
    virtual void build() = 0;
    /// Visits every place with its world matrix; the sum of their translations.
    virtual double traverse() = 0;
    /// Gives a tenth of the places new transforms, alternately those of version 1 and 2.
    virtual void change() = 0;
    /// The sum of the world translations of those places alone.
    virtual double look() = 0;
    /// As `change`, and whatever else this side has to see it with: world matrices that are kept. 0 where it has
    /// nothing.
    virtual double changeKept() = 0;

    double saying = 0;  ///< seconds of the last work that went into saying what is wanted, before anything was done
};

/// Processor time of this thread in seconds: what others do on the machine meanwhile counts as little as can be.
[[nodiscard]] inline double threadSeconds() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Bytes that malloc has given out, its own headers included.
[[nodiscard]] inline double allocatedBytes() {
    const struct mallinfo2 info = mallinfo2();
    return static_cast<double>(info.uordblks) + static_cast<double>(info.hblkhd);
}

/// Answers each word on the standard input with "SECONDS SUM SAYING"; "memory" with "BYTES 0 0": allocated since the
/// beginning.
inline int serveTree(TreeSide& side) {
    const double before = allocatedBytes();
    char word[32];
    while (std::scanf("%31s", word) == 1) {
        double sum = 0;
        if (std::strcmp(word, "build") == 0) side.clear();
        side.saying = 0;
        const double start = threadSeconds();
        if (std::strcmp(word, "build") == 0) {
            side.build();
        } else if (std::strcmp(word, "traverse") == 0) {
            sum = side.traverse();
        } else if (std::strcmp(word, "change") == 0) {
            side.change();
        } else if (std::strcmp(word, "change-traverse") == 0) {
            side.change();
            sum = side.traverse();
        } else if (std::strcmp(word, "change-look") == 0) {
            side.change();
            sum = side.look();
        } else if (std::strcmp(word, "change-kept") == 0) {
            sum = side.changeKept();
        } else if (std::strcmp(word, "memory") != 0) {
            std::fprintf(stderr, "what is '%s'?\n", word);
            return 2;
        }
        const double taken = threadSeconds() - start;
        std::printf("%.17g %.17g %.17g\n", std::strcmp(word, "memory") == 0 ? allocatedBytes() - before : taken, sum,
                    side.saying);
        std::fflush(stdout);
    }
    return 0;
}

}  // namespace tessera::bench
