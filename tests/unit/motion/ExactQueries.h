/// The elementary queries of shared/data/ccd, with their exact truth.
#pragma once

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/math/Types.h"

namespace tessera::ccd {

struct Query {
    std::string file;
    std::size_t line = 0;         ///< of its first row, from 1
    std::array<Vec3d, 8> points;  ///< four at the start, four at the end
    double slack = 0;             ///< no true coordinate is farther from the one in `points`
    bool hit = false;
};

inline std::filesystem::path folder() {
    const char* named = std::getenv("TESSERA_TEST_DATA");
    return (named ? std::filesystem::path(named)
                  : std::filesystem::path(TESSERA_SOURCE_DIR) / ".." / "shared" / "data") /
           "ccd";
}

/// A rational as the nearest double that long double division gives; `slack` grows where that is not the number itself.
/// Whole numbers of up to 63 bits over powers of two, as in the present files, are exact where they are doubles.
inline double rational(const std::string& numerator, const std::string& denominator, double& slack) {
    const long double n = std::strtold(numerator.c_str(), nullptr), d = std::strtold(denominator.c_str(), nullptr);
    const auto value = static_cast<double>(n / d);
    int power = 0;
    const bool powerOfTwo = std::frexp(static_cast<double>(d), &power) == 0.5;
    const auto digits = [](const std::string& s) { return s.size() - (s[0] == '-'); };
    // strtold of up to 18 digits is exact (below 2^63), a power of two of any length is exact as well.
    const bool exact = powerOfTwo && digits(numerator) <= 18 && static_cast<long double>(value) == n / d;
    if (!exact) slack = std::max(slack, std::abs(value) * 2.3e-16);
    return value;
}

/// kind: "vertex-face" or "edge-edge". Sorted by file.
inline std::vector<Query> read(const std::string& kind) {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder()))
        if (entry.path().extension() == ".csv" && entry.path().parent_path().filename() == kind)
            files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    std::vector<Query> queries;
    for (const std::filesystem::path& file : files) {
        std::ifstream in(file);
        std::string text;
        std::size_t row = 0;
        for (; std::getline(in, text); ++row) {
            if (row % 8 == 0)
                queries.push_back({std::filesystem::relative(file, folder()).string(), row + 1, {}, 0, false});
            std::array<std::string, 7> cells;
            std::size_t from = 0;
            for (std::string& cell : cells) {
                const std::size_t comma = text.find(',', from);
                cell = text.substr(from, comma - from);
                from = comma + 1;
            }
            Query& q = queries.back();
            for (int k = 0; k < 3; ++k) {
                const auto i = static_cast<std::size_t>(2 * k);
                q.points[row % 8][k] = rational(cells[i], cells[i + 1], q.slack);
            }
            q.hit = cells[6][0] == '1';
        }
        if (row % 8 != 0) throw std::runtime_error(file.string() + ": no whole number of queries");
    }
    return queries;
}

}  // namespace tessera::ccd
