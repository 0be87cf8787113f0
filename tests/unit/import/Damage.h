/// Files with bytes that are others, the same for each seed; and what holds of each scene that is read from them.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "server/import/reader/ReadScene.h"

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
    unsigned first = 1, end = 0;

    explicit Seeds(unsigned count = 10'000) : end(first + count) {
        if (const char* const only = std::getenv("TESSERA_SEED")) {
            first = static_cast<unsigned>(std::stoul(only));
            end = first + 1;
        } else if (const char* const runs = std::getenv("TESSERA_RUNS")) {
            end = first + static_cast<unsigned>(std::stoul(runs));
        }
    }
};

/// Else the damage is seen at the door, and what lies behind it is not tried.
inline void expectSomeRead(std::size_t read, const Seeds& seeds) {
    const std::size_t tried = seeds.end - seeds.first;
    testing::Test::RecordProperty("read_of_1000", static_cast<int>(1000 * read / tried));
    if (tried >= 1000) EXPECT_GT(100 * read, tried) << read << " of " << tried << " files are read";
}

template <typename Number>
std::vector<Number> numbersOf(const PlainScene& scene, std::uint32_t blob) {
    if (blob == 0) return {};
    const Bytes& bytes = scene.blobs.at(blob - 1);
    std::vector<Number> numbers(bytes.size() / sizeof(Number));
    EXPECT_EQ(bytes.size() % sizeof(Number), 0u);
    if (!numbers.empty()) std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(Number));
    return numbers;
}

/// Each vertex is somewhere and has as much as the others; indices are those of vertices.
inline void expectSoundMeshes(const PlainScene& scene) {
    for (const proto::scene::Mesh& mesh : scene.file.mesh()) {
        const std::vector<float> positions = numbersOf<float>(scene, mesh.positions_blob());
        const std::size_t vertices = positions.size() / 3;
        ASSERT_GT(vertices, 0u) << mesh.name();
        ASSERT_EQ(positions.size() % 3, 0u) << mesh.name();
        for (const float number : positions) ASSERT_TRUE(std::isfinite(number)) << mesh.name();
        const auto expectEach = [&](std::uint32_t blob, std::size_t numbers) {
            const std::size_t all = blob == 0 ? 0 : numbers * vertices;
            EXPECT_EQ(numbersOf<std::uint32_t>(scene, blob).size(), all) << mesh.name();
        };
        expectEach(mesh.normals_blob(), 3);
        expectEach(mesh.tangents_blob(), 4);
        expectEach(mesh.texcoords_blob(), 2);
        expectEach(mesh.texcoords1_blob(), 2);
        expectEach(mesh.colors_blob(), 1);
        const std::vector<std::uint32_t> indices = numbersOf<std::uint32_t>(scene, mesh.indices_blob());
        for (const std::uint32_t index : indices) ASSERT_LT(index, vertices) << mesh.name();
        std::uint64_t corners = 0;
        for (const std::uint32_t length : numbersOf<std::uint32_t>(scene, mesh.lengths_blob())) corners += length;
        EXPECT_LE(corners, indices.empty() ? vertices : indices.size()) << mesh.name();
    }
}

}  // namespace tessera
