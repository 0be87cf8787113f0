/// PLY files as they are written besides triangles and quads: strips, several elements of faces, rows that are none,
/// vertices that stand nowhere.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstring>

#include "common/cores/Geometry.h"
#include "common/cores/Material.h"
#include "server/import/reader/BeforeAssimp.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/Picture.h"

namespace tessera {
namespace {

struct ShownPly {
    std::uint64_t triangles = 0, points = 0;
    double area = 0;  ///< in the plane of X and Y; triangles that face down count against those that face up
    std::string said;
    bool refused = false;
    [[nodiscard]] bool says(std::string_view part) const { return said.find(part) != std::string::npos; }
};
ShownPly shownPly(const std::string& bytes, bool verbatim = false) {
    const Scratch scratch;
    ImportOptions options = importOptions();
    options.verbatim = verbatim;
    Expected<ImportedScene> scene = importScene(scratch.write("a.ply", bytes), kRootNode, options);
    if (!scene) return {.said = messageOf(scene), .refused = true};
    ShownPly shown{.triangles = scene->triangles, .said = fmt::format("{}", fmt::join(scene->notes, "\n"))};
    const ImportedAspect aspect(std::move(*scene));
    for (const Geometry* geometry : allOf<Geometry>(aspect)) {
        const auto places = geometry->positions.as<float>();
        if (geometry->primitive == Geometry::kPoints) shown.points += places.size() / 3;
        const auto corners = geometry->indices.as<std::uint32_t>();
        const auto at = [&](std::size_t corner) {
            return Vec2d(places[std::size_t{3} * corners[corner]], places[std::size_t{3} * corners[corner] + 1]);
        };
        for (std::size_t i = 0; i + 3 <= corners.size(); i += 3) {
            const Vec2d a = at(i + 1) - at(i), b = at(i + 2) - at(i);
            shown.area += 0.5 * (a.x() * b.y() - a.y() * b.x());
        }
    }
    return shown;
}

constexpr const char* kFormats[] = {"ascii", "binary_little_endian", "binary_big_endian"};

/// A file in any format, number by number.
class PlyWriter {
public:
    PlyWriter(std::string format, const std::string& elements)
        : format_(std::move(format)), bytes_("ply\nformat " + format_ + " 1.0\n" + elements + "end_header\n") {}

    template <typename... Numbers>
    PlyWriter& row(Numbers... numbers) {
        (number(numbers), ...);
        if (isText()) bytes_.back() = '\n';
        return *this;
    }
    /// Its length in a number of that type; `before`: numbers of a byte in front of it.
    template <typename Length>
    PlyWriter& list(const std::vector<std::int32_t>& numbers, const std::vector<std::uint8_t>& before = {}) {
        for (const std::uint8_t each : before) number(each);
        number(static_cast<Length>(numbers.size()));
        for (const std::int32_t each : numbers) number(each);
        if (isText()) bytes_.back() = '\n';
        return *this;
    }
    [[nodiscard]] const std::string& bytes() const { return bytes_; }

private:
    [[nodiscard]] bool isText() const { return format_ == "ascii"; }
    template <typename Number>
    void number(Number value) {
        if (isText()) {
            bytes_ += fmt::format("{} ", value);
            return;
        }
        std::string raw(sizeof(value), '\0');
        std::memcpy(raw.data(), &value, sizeof(value));
        if (format_ == "binary_big_endian") std::ranges::reverse(raw);
        bytes_ += raw;
    }
    std::string format_, bytes_;
};

const std::string kSixCorners = "element vertex 6\nproperty float x\nproperty float y\nproperty float z\n";

/// A ladder: corners 0 and 1 below, 4 and 5 above.
PlyWriter ladder(const char* format, const std::string& elements) {
    PlyWriter ply(format, kSixCorners + elements);
    for (const float y : {0.0F, 1.0F, 2.0F}) ply.row(0.0F, y, 0.0F).row(1.0F, y, 0.0F);
    return ply;
}

/// What no file says is no white: views that have a colour for what says none give it theirs.
TEST(PlyMaterials, SayNothingWhereTheFileSaysNoColor) {
    const auto colorOf = [](const std::string& properties, const std::string& rest) {
        const Scratch scratch;
        const std::string file =
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
            "float z\n" +
            properties +
            "element face 1\nproperty list uchar int vertex_indices\n"
            "end_header\n0 0 0" +
            rest + "\n1 0 0" + rest + "\n0 1 0" + rest + "\n3 0 1 2\n";
        Expected<ImportedScene> scene = importScene(scratch.write("a.ply", file), kRootNode, importOptions());
        EXPECT_TRUE(scene) << messageOf(scene);
        const ImportedAspect aspect(std::move(*scene));
        return allOf<Material>(aspect).at(0)->baseColor;
    };
    EXPECT_EQ(colorOf("", ""), Material().baseColor);
    EXPECT_EQ(colorOf("property uchar red\nproperty uchar green\nproperty uchar blue\n", " 9 99 199"), Vec4f::Ones())
        << "its corners' colours are as they are";
}

TEST(PlyStrips, HaveAllTheirTriangles) {
    for (const char* format : kFormats) {
        SCOPED_TRACE(format);
        const std::string ofOne = ladder(format, "element tristrips 1\nproperty list int int vertex_indices\n")
                                      .list<std::int32_t>({0, 1, 2, 3, 4, 5})
                                      .bytes();
        const ShownPly one = shownPly(ofOne);
        EXPECT_EQ(shownPly(ofOne, true).triangles, 4u) << "as bare geometry";
        EXPECT_EQ(one.triangles, 4u) << one.said;
        EXPECT_EQ(one.area, 2) << "every second one is turned around";
        EXPECT_FALSE(one.says("left out")) << one.said;
        // -1 begins a new strip, whose first triangle is not turned around; what names a vertex twice joins strips.
        const ShownPly restarted =
            shownPly(ladder(format, "element tristrips 2\nproperty list uchar int vertex_indices\n")
                         .list<std::uint8_t>({0, 1, 2, 3, -1, 2, 3, 4, -1, -1, 0, 1, -1})
                         .list<std::uint8_t>({3, 5, 4, 4})
                         .bytes());
        EXPECT_EQ(restarted.triangles, 4u) << restarted.said;
        EXPECT_EQ(restarted.area, 2);
        const ShownPly unsound = shownPly(ladder(format, "element tristrips 1\nproperty list int int vertex_indices\n")
                                              .list<std::int32_t>({0, 1, 2, 3, 77})
                                              .bytes());
        EXPECT_EQ(unsound.triangles, 2u) << unsound.said;
        EXPECT_WORDS(unsound.said);
    }
}

TEST(PlyStrips, StandBesideFacesAndOtherElements) {
    for (const char* format : kFormats) {
        SCOPED_TRACE(format);
        PlyWriter ply = ladder(format,
                               "element face 2\nproperty uchar quality\nproperty list uchar int vertex_index\nelement "
                               "camera 1\nproperty int view_px\nelement tristrips 2\n"
                               "property list int int vertex_indices\n");
        ply.list<std::uint8_t>({0, 1, 3, 2}, {7})
            .list<std::uint8_t>({2, 3, 4}, {8})
            .row(5)
            .list<std::int32_t>({3, 5, 4})
            .list<std::int32_t>({0, 1, 2, 3, 4, 5});
        const ShownPly shown = shownPly(ply.bytes());
        EXPECT_EQ(shown.triangles, 2u + 1 + 1 + 4) << shown.said;
        EXPECT_EQ(shown.area, 4);
        EXPECT_WORDS(shown.said);
    }
}

TEST(PlyStrips, OfTwoElementsOfFacesBothAreShown) {
    PlyWriter ply = ladder("ascii",
                           "element face 1\nproperty list uchar int vertex_indices\nelement face 200\nproperty list "
                           "uchar int vertex_indices\n");
    ply.list<std::uint8_t>({0, 1, 2});
    for (int i = 0; i < 200; ++i) ply.list<std::uint8_t>({1, 3, 2});
    const ShownPly shown = shownPly(ply.bytes());
    EXPECT_EQ(shown.triangles, 201u) << shown.said;
    const ShownPly vertices = shownPly("ply\nformat ascii 1.0\n" + kSixCorners + kSixCorners + "end_header\n0 0 0\n");
    EXPECT_TRUE(vertices.refused) << vertices.said;
    EXPECT_WORDS(vertices.said);
}

TEST(PlyStrips, ThatAreCutAreShownAsFarAsTheyAreWhole) {
    for (const char* format : kFormats) {
        SCOPED_TRACE(format);
        const std::string all = ladder(format, "element tristrips 2\nproperty list int int vertex_indices\n")
                                    .list<std::int32_t>({0, 1, 2, 3})
                                    .list<std::int32_t>({2, 3, 4, 5})
                                    .bytes();
        const ShownPly shown = shownPly(all.substr(0, all.size() - 3));
        EXPECT_EQ(shown.triangles, 2u) << shown.said;
        EXPECT_WORDS(shown.said);
    }
}

TEST(PlyRows, VerticesWithoutAPlaceAreRefused) {
    for (const char* missing : {"x", "y", "z"}) {
        std::string head = "ply\nformat ascii 1.0\ncomment flat\n" + kSixCorners.substr(0, 15) + "2\n";
        for (const char* each : {"x", "y", "z"})
            if (std::string_view(each) != missing) head += std::string("property float ") + each + "\n";
        const ShownPly shown = shownPly(head + "end_header\n0 0\n1 1\n");
        EXPECT_TRUE(shown.refused) << shown.said;
        EXPECT_WORDS(shown.said);
    }
    const ShownPly none = shownPly("ply\nformat ascii 1.0\nelement vertex 1\nproperty float quality\nend_header\n0\n");
    EXPECT_TRUE(none.refused) << none.said;
    EXPECT_WORDS(none.said);
    const ShownPly list = shownPly(
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty list uchar float x\nproperty float y\nproperty float "
        "z\nend_header\n1 0 0 0\n");
    EXPECT_TRUE(list.refused) << list.said;
    EXPECT_WORDS(list.said);
}

TEST(PlyRows, OfVerticesThatAreNoneAreRefusedByTheirLine) {
    const std::string head =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face "
        "1\nproperty list uchar int vertex_indices\nend_header\n";
    const ShownPly few = shownPly(head + "0 0 0\n\n1 0\n0 1 0\n3 0 1 2\n");
    EXPECT_TRUE(few.refused) << few.said;
    EXPECT_WORDS(few.said);
    const ShownPly word = shownPly(head + "0 0 0\n1 zero 0\n0 1 0\n3 0 1 2\n");
    EXPECT_TRUE(word.refused) << word.said;
    EXPECT_WORDS(word.said);
    EXPECT_EQ(shownPly(head + "0 0 0\n1. +0 -0e5\n0 1 0\n3 0 1 2\n").triangles, 1u);
}

/// As an exporter left them that wrote the faces' list among what vertices have (assimp's issue 623).
TEST(PlyRows, OfVerticesThatLackWhatIsNoPlaceAreShown) {
    const std::string head =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty list "
        "uchar uint vertex_indices\nend_header\n";
    const ShownPly shown = shownPly(head + "0 0 0\n1 0 0 2 3 4\n0 1 0\n");
    EXPECT_EQ(shown.points, 3u) << shown.said;
    EXPECT_WORDS(shown.said);
}

TEST(PlyRows, OfFacesThatAreNoneAreLeftOutAndCounted) {
    for (const char* const row : {"3 1 3", "3 1 x 2", "three 1 3 2"}) {
        std::string text = ladder("ascii", "element face 3\nproperty list uchar int vertex_indices\n").bytes();
        text += std::string("3 0 1 2\n") + row + "\n3 1 3 2\n";
        const ShownPly shown = shownPly(text);
        EXPECT_EQ(shown.triangles, 2u) << shown.said;
        EXPECT_EQ(shown.area, 1);
        EXPECT_WORDS(shown.said);
    }
    const ShownPly none =
        shownPly(ladder("ascii", "element face 1\nproperty list uchar int vertex_indices\n").bytes() + "3 0 1\n");
    EXPECT_TRUE(none.refused) << none.said;
    EXPECT_WORDS(none.said);
}

/// Assimp would make points of them, which are shown as balls.
TEST(PlyRows, OfFacesWithoutTwoCornersAreLeftOutAndCounted) {
    for (const char* const format : kFormats)
        for (const bool none : {false, true}) {
            PlyWriter file = ladder(format, "element face 3\nproperty list uchar int vertex_indices\n");
            file.list<std::uint8_t>({0, 1, 2})
                .list<std::uint8_t>(none ? std::vector<std::int32_t>() : std::vector<std::int32_t>{3})
                .list<std::uint8_t>({1, 3, 2});
            const ShownPly shown = shownPly(file.bytes());
            EXPECT_EQ(shown.triangles, 2u) << format << shown.said;
            EXPECT_EQ(shown.points, 0u) << format;
            EXPECT_WORDS(shown.said) << format;
        }
}

TEST(PlyStrips, WithoutATriangleAreNamed) {
    for (const char* const format : kFormats) {
        SCOPED_TRACE(format);
        const ShownPly some = shownPly(ladder(format, "element tristrips 3\nproperty list int int vertex_indices\n")
                                           .list<std::int32_t>({0, 1, 2, 3})
                                           .list<std::int32_t>({0, 1})
                                           .list<std::int32_t>({-1, -1, -1, -1})
                                           .bytes());
        EXPECT_EQ(some.triangles, 2u) << some.said;
        EXPECT_WORDS(some.said);
        const ShownPly none = shownPly(ladder(format, "element tristrips 1\nproperty list int int vertex_indices\n")
                                           .list<std::int32_t>({0, 1})
                                           .bytes());
        EXPECT_TRUE(none.refused) << none.said;
        EXPECT_WORDS(none.said);
    }
}

TEST(PlyRows, ThatGoOnBehindWhatTheHeaderAsksForAreNamed) {
    const ShownPly shown = shownPly(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face "
        "1\nproperty list uchar int vertex_indices\n"
        "end_header\n0 0 0\n1 0 0 7\n0 1 0 7 8\n3 0 1 2 255\n");
    EXPECT_EQ(shown.triangles, 1u) << shown.said;
    EXPECT_WORDS(shown.said);
}

/// Assimp went on with the number before it, or took 0.
TEST(PlyRows, OfTypesThatNobodyKnowsAreRefused) {
    for (const char* const format : kFormats)
        for (const char* const property : {"property float128 z", "property int64 id", "property list uchar int64 more",
                                           "property list uint128 int more"}) {
            const std::string elements =
                std::string("element vertex 1\nproperty float x\n") + property + "\nproperty float y\n";
            const ShownPly shown =
                shownPly(PlyWriter(format, elements).row(0.0F, 1, 2.0F).bytes() + std::string(40, '\0'));
            EXPECT_TRUE(shown.refused) << shown.said;
            EXPECT_WORDS(shown.said) << format;
        }
}

TEST(PlyRows, MayEndWithACarriageReturnAlone) {
    std::string text = ladder("ascii", "element face 1\nproperty list uchar int vertex_indices\n")
                           .list<std::uint8_t>({0, 1, 2})
                           .bytes();
    std::ranges::replace(text, '\n', '\r');
    const ShownPly shown = shownPly(text);
    EXPECT_EQ(shown.triangles, 1u) << shown.said;
    EXPECT_EQ(shown.area, 0.5);
    EXPECT_FALSE(shown.says("cut")) << shown.said;
}

TEST(PlyRows, OfColoursThatLackAChannelAreNamed) {
    const auto said = [](const std::string& properties, int numbers) {
        std::string row = "0 0 0";
        for (int i = 0; i < numbers; ++i) row += " 255";
        return shownPly(
                   "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n" +
                   properties + "end_header\n" + row + "\n")
            .said;
    };
    const std::string red = "property uchar red\n", green = "property uchar green\n", blue = "property uchar blue\n",
                      alpha = "property uchar alpha\n";
    EXPECT_WORDS(said(red, 1));
    EXPECT_WORDS(said(red + blue, 2));
    EXPECT_WORDS(said(alpha, 1));
    EXPECT_EQ(said(red + green + blue, 3).find("colours"), std::string::npos);
    EXPECT_EQ(said("", 0).find("colours"), std::string::npos);
}

TEST(PlyRows, OfVerticesThatSayOneNumberTwiceAreRefused) {
    const ShownPly shown = shownPly(
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nproperty float "
        "x\nend_header\n1 2 3 4\n");
    EXPECT_TRUE(shown.refused) << shown.said;
    EXPECT_WORDS(shown.said);
}

TEST(PlyRows, BehindTheLastOneAreNamed) {
    const std::string elements = "element face 1\nproperty list uchar int vertex_indices\n";
    const std::string text = ladder("ascii", elements).list<std::uint8_t>({0, 1, 2}).bytes(),
                      binary = ladder("binary_little_endian", elements).list<std::uint8_t>({0, 1, 2}).bytes();
    for (const char* blank : {"", "\n", "\r\n \n"}) {
        EXPECT_FALSE(shownPly(text + blank).says("left out")) << shownPly(text + blank).said;
        if (std::strlen(blank) < 2) {
            EXPECT_FALSE(shownPly(binary + blank).says("left out")) << shownPly(binary + blank).said;
        }
    }
    const ShownPly line = shownPly(text + "\n3 1 3 2\n");
    EXPECT_EQ(line.triangles, 1u);
    EXPECT_WORDS(line.said);
    const ShownPly bytes = shownPly(binary + std::string(13, '\3'));
    EXPECT_EQ(bytes.triangles, 1u);
    EXPECT_WORDS(bytes.said);
    const std::string cloud = ladder("binary_big_endian", "").bytes() + "more";
    EXPECT_WORDS(shownPly(cloud).said);
    EXPECT_EQ(shownPly(cloud).points, 6u);
}

/// 12 bytes for each of 2^62 + 1 vertices are as many as for one, where sixty-four bits wrap around.
TEST(PlyRows, MoreThanMemoryCanCountAreCut) {
    const std::string rows(12, '\0');
    const ShownPly shown = shownPly(
        "ply\nformat binary_little_endian 1.0\nelement vertex 4611686018427387905\nproperty float x\n"
        "property float y\nproperty float z\nend_header\n" +
        rows);
    EXPECT_FALSE(shown.refused) << shown.said;
    EXPECT_EQ(shown.points, 1u);
    EXPECT_WORDS(shown.said);
}

}  // namespace
}  // namespace tessera
