/// Files with bytes that are others, the same for each seed.
#pragma once

#include <cstdlib>
#include <random>
#include <string>
#include <string_view>

namespace tessera {

/// One to four changes: a byte, a letter, bytes that are there twice, bytes that are gone; of one file in ten its end.
/// `letters`: those that mean something in the format.
inline std::string damaged(std::string bytes, std::string_view letters, unsigned seed) {
    std::mt19937 random(seed);
    for (unsigned change = 0; change < 1 + seed % 4; ++change) {
        const std::size_t at = random() % bytes.size();
        switch (random() % 4) {
            case 0:
                bytes[at] = static_cast<char>(random());
                break;
            case 1:
                bytes[at] = letters[random() % letters.size()];
                break;
            case 2:
                bytes.insert(at, bytes.substr(random() % bytes.size(), random() % 40));
                break;
            default:
                bytes.erase(at, random() % 20);
        }
        if (bytes.empty()) bytes = " ";
    }
    if (random() % 10 == 0) bytes.resize(random() % bytes.size());
    return bytes;
}

/// The seeds of a test: TESSERA_SEED alone, or TESSERA_RUNS of them, or as many as a test has time for.
struct Seeds {
    unsigned first = 1, end = 10'001;

    Seeds() {
        if (const char* const only = std::getenv("TESSERA_SEED")) {
            first = static_cast<unsigned>(std::stoul(only));
            end = first + 1;
        } else if (const char* const runs = std::getenv("TESSERA_RUNS")) {
            end = first + static_cast<unsigned>(std::stoul(runs));
        }
    }
};

}  // namespace tessera
