/// Texts and the surfaces in them, and texts that are wrong in all ways. A failing seed: TESSERA_SEED=N
/// build/bin/unit_nurbs.
#include "common/freeform/nurbs/ObjSurfaces.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <span>
#include <string>

#include "tests/support/words/Words.h"
#include "tests/unit/nurbs/NurbsOracle.h"

namespace tessera {
namespace {

/// The plane z = x over [0, 4] × [0, 3], cut by a rational circle, with an island around (3.2, 1) of straight lines.
const std::string kTrimmed =
    "# a comment\r\n"
    "mtllib some.mtl\n"
    "v 0 0 0\nv 4 0 4\nv 0 3 0\nv 4 3 4\n"
    "vp 3 1.5 1\nvp 3 2.5 0.70710678118654752\nvp 2 2.5 1\nvp 1 2.5 0.70710678118654752\nvp 1 1.5\n"
    "vp 1 0.5 0.70710678118654752\nvp 2 0.5\nvp 3 0.5 0.70710678118654752\n"
    "vp 3.1 0.1\nvp 3.9 0.1\nvp 3.9 1.1\nvp 3.1 1.1\n"
    "cstype rat bspline\ndeg 2\n"
    "curv2 1 2 3 4 5 6 7 8 -12\nparm u 0 0 0 1 1 2 2 \\\n  3 3 4 4 \\\r\n 4\nend\n"
    "cstype bezier\ndeg 1\ncurv2 9 10 11 12 9\nparm u 0 1 2 3 4\nend\n"
    "g part\nusemtl steel\nf 1 2 3\n"
    "cstype bspline\ndeg 1 1\n"
    "surf 0 4 0 3 1/1/1 2//2 3/4 -1\nparm u 0 0 4 4\nparm v 0 0 3 3\n"
    "hole 0 4 1\ntrim 0 4 2\nscrv 0 1 2\nsp 1\nend\n"
    "con 1 0 1 1 1 0 1 2\n";

TEST(ObjSurfaces, AreReadWithTheirLoops) {
    const Expected<std::vector<NurbsSurface>> read = readNurbsObj(kTrimmed, "cut.obj");
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->size(), 1u);
    const NurbsSurface& surface = read->front();
    EXPECT_EQ(surface.domain().u, (ParameterRange{0, 4}));
    EXPECT_EQ(surface.domain().v, (ParameterRange{0, 3}));
    EXPECT_EQ(evaluate(surface, 3, 1).at.point, Vec3d(3, 1, 3));
    // Kept is what the outer loop has and the hole has not.
    EXPECT_EQ(evaluate(surface, 3.5, 0.5).side, TrimSide::kKept);
    EXPECT_EQ(evaluate(surface, 2, 1.5).side, TrimSide::kTrimmedAway);
    EXPECT_EQ(evaluate(surface, 0.5, 2.9).side, TrimSide::kTrimmedAway);
    EXPECT_EQ(evaluate(surface, 3.1, 0.5).side, TrimSide::kOnEdge);
}

std::string textOf(const char* key, std::span<const double> x) {
    std::string text = key;
    for (std::size_t i = 0; i < x.size(); ++i) text += fmt::format("{}{:.17g}", i % 7 == 6 ? " \\\n  " : " ", x[i]);
    return text + "\n";
}
std::string textOf(const NurbsDefinition& d) {
    std::string text, indices;
    for (std::size_t i = 0; i < d.points.size(); ++i) {
        const Vec4d& p = d.points[i];
        text += fmt::format("v {:.17g} {:.17g} {:.17g} {:.17g}\n", p.x() / p.w(), p.y() / p.w(), p.z() / p.w(), p.w());
        indices += fmt::format(" {}", static_cast<long>(i) - static_cast<long>(d.points.size()));
    }
    std::string trims;
    int curves = 0;
    for (const TrimLoop& loop : d.loops) {
        trims += loop.role == LoopRole::kHole ? "hole" : "trim";
        for (const TrimCurve& c : loop.curves) {
            std::string points;
            for (std::size_t i = 0; i < c.points.size(); ++i) {
                const Vec3d& p = c.points[i];
                text += fmt::format("vp {:.17g} {:.17g} {:.17g}\n", p.x() / p.z(), p.y() / p.z(), p.z());
                points += fmt::format(" {}", static_cast<long>(i) - static_cast<long>(c.points.size()));
            }
            text += fmt::format("cstype rat bspline\ndeg {}\ncurv2{}\n{}end\n", c.knots.degree, points,
                                textOf("parm u", c.knots.knots));
            trims += fmt::format(" {:.17g} {:.17g} {}", c.begin, c.end, ++curves);
        }
        trims += "\n";
    }
    const ParameterRange u = d.rangeU.value_or(d.u.domain()), v = d.rangeV.value_or(d.v.domain());
    return text +
           fmt::format("cstype rat bspline\ndeg {} {}\nsurf {:.17g} {:.17g} {:.17g} {:.17g}{}\n", d.u.degree,
                       d.v.degree, u.lower, u.upper, v.lower, v.upper, indices) +
           textOf("parm u", d.u.knots) + textOf("parm v", d.v.knots) + trims + "end\n";
}

TEST(ObjSurfaces, AreTheOnesThatWereWritten) {
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(100); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        NurbsDefinition d = someSurface(random);
        if (!(d.u.domain().size() > 0 && d.v.domain().size() > 0)) continue;
        const ParameterRange u = d.u.domain(), v = d.v.domain();
        d.loops.push_back(
            {seed % 2 == 0 ? LoopRole::kHole : LoopRole::kOuter,
             {circle({u.lower + 0.4 * u.size(), v.lower + 0.5 * v.size()}, 0.3 * std::min(u.size(), v.size()))}});
        if (seed % 3 == 0)
            d.loops.push_back({LoopRole::kHole, {circle({u.upper, v.upper}, 0.2 * std::min(u.size(), v.size()))}});
        const Expected<NurbsSurface> made = NurbsSurface::make(d);
        ASSERT_TRUE(made) << made.error().message;
        const Expected<std::vector<NurbsSurface>> read = readNurbsObj(textOf(d), "written.obj");
        ASSERT_TRUE(read) << read.error().message << " TESSERA_SEED=" << seed;
        for (int k = 0; k < 20; ++k) {
            const double s = between(random, u), t = between(random, v);
            const NurbsPoint a = evaluate(*made, s, t), b = evaluate(read->front(), s, t);
            ASSERT_LT((a.at.point - b.at.point).norm(), 1e-14) << "TESSERA_SEED=" << seed;
            ASSERT_EQ(a.side, b.side) << "TESSERA_SEED=" << seed;
        }
    }
}

/// A row of vertices 1 to n at random places, and the same row one up in y.
struct TwoRows {
    std::vector<Vec3d> row;
    std::string text, indices;
};
TwoRows twoRows(std::mt19937_64& random, int n) {
    TwoRows rows;
    for (const double up : {0.0, 1.0})
        for (int i = 0; i < n; ++i) {
            if (up == 0)
                rows.row.emplace_back(between(random, {-1, 1}), between(random, {-1, 1}), between(random, {-1, 1}));
            const Vec3d p = rows.row[static_cast<std::size_t>(i)] + Vec3d(0, up, 0);
            rows.text += fmt::format("v {:.17g} {:.17g} {:.17g} 7\n", p.x(), p.y(),
                                     p.z());  // not rational: the weight says nothing
            rows.indices += fmt::format(" {}", rows.indices.empty() ? 1 : static_cast<int>(up) * n + i + 1);
        }
    return rows;
}

TEST(ObjSurfaces, OfOtherTypesAreConvertedExactly) {
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(100); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        // Two segments of u, from 0 to 1 and from 1 to 3; v is a Bézier curve of degree 1, but of the type of u.
        const auto check = [&](const Expected<std::vector<NurbsSurface>>& read, double height,
                               const std::function<Vec3d(std::size_t, double)>& row) {
            ASSERT_TRUE(read) << read.error().message << " TESSERA_SEED=" << seed;
            for (int k = 0; k < 20; ++k) {
                const double u = k == 0 ? 0 : k == 1 ? 3 : between(random, {0, 3}), v = between(random, {0, 1});
                const Vec3d expected = u < 1 ? row(0, u) : row(1, (u - 1) / 2);
                ASSERT_LT((evaluate(read->front(), u, v).at.point - expected - Vec3d(0, v * height, 0)).norm(), 1e-13)
                    << u << " TESSERA_SEED=" << seed;
            }
        };
        {  // Catmull-Rom, by Hermite's cubics; a surface of cardinal curves needs four in v too: twice two rows,
           // evenly.
            TwoRows rows = twoRows(random, 5);
            std::string text = rows.text, indices = rows.indices;
            for (const double up : {2.0, 3.0})
                for (int i = 0; i < 5; ++i) {
                    const Vec3d p = rows.row[static_cast<std::size_t>(i)] + Vec3d(0, up, 0);
                    text += fmt::format("v {:.17g} {:.17g} {:.17g}\n", p.x(), p.y(), p.z());
                    indices += fmt::format(" {}", static_cast<int>(up) * 5 + i + 1);
                }
            const auto row = [&](std::size_t s, double t) -> Vec3d {
                const Vec3d *c = rows.row.data() + s, from = 0.5 * (c[2] - c[0]), to = 0.5 * (c[3] - c[1]);
                return c[1] * (2 * t * t * t - 3 * t * t + 1) + c[2] * (3 * t * t - 2 * t * t * t) +
                       from * (t * t * t - 2 * t * t + t) + to * (t * t * t - t * t) + Vec3d(0, 1, 0);
            };
            check(readNurbsObj(
                      text + "cstype cardinal\ndeg 3 3\nsurf 0 3 0 1" + indices + "\nparm u 0 1 3\nparm v 0 1\nend\n",
                      "c.obj"),
                  1, row);
        }
        {  // A random basis of degree 2 that sums to 1, two points on per segment.
            const TwoRows rows = twoRows(random, 5);
            std::array<std::array<double, 3>, 3> b{};
            for (std::size_t j = 0; j < 3; ++j) {
                b[0][j] = between(random, {-1, 1});
                b[1][j] = between(random, {-1, 1});
                b[2][j] = (j == 0 ? 1 : 0) - b[0][j] - b[1][j];
            }
            std::string matrix = "bmat u";
            for (const auto& line : b)
                for (const double x : line) matrix += fmt::format(" {:.17g}", x);
            const auto row = [&](std::size_t s, double t) -> Vec3d {
                Vec3d sum = Vec3d::Zero();
                for (std::size_t i = 0; i < 3; ++i)
                    sum += (b[i][0] + b[i][1] * t + b[i][2] * t * t) * rows.row[2 * s + i];
                return sum;
            };
            check(
                readNurbsObj(rows.text + "cstype bmatrix\ndeg 2 1\nstep 2 1\n" + matrix +
                                 "\nbmat v 1 -1 0 1\nsurf 0 3 0 1" + rows.indices + "\nparm u 0 1 3\nparm v 0 1\nend\n",
                             "b.obj"),
                1, row);
        }
        {  // Bézier, by the cubic's formula.
            const TwoRows rows = twoRows(random, 7);
            const auto row = [&](std::size_t s, double t) -> Vec3d {
                const Vec3d* c = rows.row.data() + 3 * s;
                const double r = 1 - t;
                return r * r * r * c[0] + 3 * r * r * t * c[1] + 3 * r * t * t * c[2] + t * t * t * c[3];
            };
            check(readNurbsObj(rows.text + "cstype bezier\ndeg 3 1\nsurf 0 3 0 1" + rows.indices +
                                   "\nparm u 0 1 3\nparm v 0 1\nend\n",
                               "z.obj"),
                  1, row);
        }
    }
}

TEST(ObjSurfaces, ThatAreWrongAreToldWithTheirLine) {
    const std::string head = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvp 0 0\nvp 1 0\nvp 1 1\ncstype bspline\ndeg 1 1\n",
                      surf = head + "surf 0 1 0 1 1 2 3 4\n", knots = "parm u 0 0 1 1\nparm v 0 0 1 1\n",
                      open = head + "curv2 1 2 3\nparm u 0 0 1 2 2\nend\nsurf 0 1 0 1 1 2 3 4\n" + knots;
    ASSERT_TRUE(readNurbsObj(surf + knots + "end\n", "a"));
    const auto says = [](const std::string& text, const std::string& words, ErrorCode code = ErrorCode::kBadInput) {
        const Expected<std::vector<NurbsSurface>> read = readNurbsObj(text, "a.obj");
        ASSERT_FALSE(read) << words;
        EXPECT_EQ(read.error().code, code);
        EXPECT_EQ(read.error().message.rfind(words, 0), 0u) << read.error().message;
    };
    says("", "a.obj: there is no free-form surface");
    says("v 1 2 x\n", "a.obj:1: 'x' is not a finite number");
    says("\n\nv 1 \\\n 2\n", "a.obj:3: v needs 3 numbers");
    says("v 1 2 nan\n", "a.obj:1: 'nan' is not a finite number");
    says("v 1 2 1e999\n", "a.obj:1: '1e999' is not a finite number");
    says("vp\n", "a.obj:1: vp needs 1 to 3 numbers");
    says("cstype rat\n", "a.obj:1: cstype needs one type");
    says("cstype rat taylor\n", "a.obj:1: cstype taylor is not read");
    says("cstype nurbs\n", "a.obj:1: cstype 'nurbs' is not known");
    says("deg -1\n", "a.obj:1: '-1' is no deg");
    says("deg 1.5\n", "a.obj:1: '1.5' is no deg");
    says("bzp 1 2 3\n", "a.obj:1: 'bzp' is a statement of version 2.11");
    says("call other.obj\n", "a.obj:1: 'call' would read");
    says("bmat w 1\n", "a.obj:1: bmat needs u or v first");
    says("parm u 1\n", "a.obj:1: 'parm' stands outside");
    says("v 0 0 0\nsurf 0 1 0 1 1 1\n", "a.obj:2: surf comes before any cstype");
    says(head + "surf 0 1 0 1 1 2 3 5\n", "a.obj:10: there is no vertex 5: so far there are 4");
    says(head + "surf 0 1 0 1 1 2 3 -5\n", "a.obj:10: there is no vertex -5");
    says(head + "surf 0 1 0 1 1 2 3 0\n", "a.obj:10: there is no vertex 0");
    says(head + "surf 0 1 0 1 1 2 3 1.5\n", "a.obj:10: '1.5' is not the number of a vertex");
    says(head + "surf 0 1 0 1 1 2 3 99999999999999999999\n",
         "a.obj:10: '99999999999999999999' is not the number of a vertex");
    says(head + "surf 0 1 0\n", "a.obj:10: surf needs 4 parameters and 2 control points");
    says(surf, "a.obj:10: surf has no end");
    says(surf + "tirm 0 1 1\n", "a.obj:11: 'tirm' is no statement of a surf");
    says(surf + "surf 0 1 0 1 1 2 3 4\n",
         "a.obj:11: 'surf' is no statement of a surf, and the one of line 10 has no end yet");
    says(surf + "end\n", "a.obj:10: surf: parameter u: there is no parm");
    says(surf + knots + "parm u 0 1\n", "a.obj:13: parm u is given twice");
    says(surf + "parm u 0 0 1\nparm v 0 0 1 1\nend\n", "a.obj:10: surf: parameter u: 3 knots are too few");
    says(surf + "parm u 0 0 1 1 1\nparm v 0 0 1 1\nend\n",
         "a.obj:10: surf: there are 4 control points, not the 3 by 2");
    says(surf + "parm u 0 1 0 1\nparm v 0 0 1 1\nend\n", "a.obj:10: surf: knots of u: number 3 is below");
    says(head + "surf 0 2 0 1 1 2 3 4\n" + knots + "end\n", "a.obj:10: surf: the range of u goes beyond");
    says(head + "surf 0 1 1 0 1 2 3 4\n" + knots + "end\n", "a.obj:10: surf: the range of v is empty or descends");
    says("v 0 0 0 0\n" + head + "cstype rat bspline\nsurf 0 1 0 1 1 2 3 4\n" + knots + "end\n",
         "a.obj:12: surf: the weight of control point 1 is not above 0");
    says(surf + knots + "trim 0 1 1\n", "a.obj:13: there is no curv2 1: so far there are 0");
    says(surf + knots + "trim 0 1\n", "a.obj:13: trim needs two parameters and a curve");
    says(open + "trim 0 2 1\nend\n",
         "a.obj:13: surf: outer loop (loop 1): it is open: a curve ends at (1 1), the next begins at (0 0)");
    says(open + "hole 0 3 1\nend\n",
         "a.obj:13: surf: hole (loop 1), curve 1: the curve is used beyond the range of its knots");
    says(head + "curv2 1 2 3\ntrim 0 1 1\n", "a.obj:11: trim belongs to a surf, not to a curv2");
    says(head + "curv2 1 2 3\nparm u 0 0 1 1\nend\n", "a.obj:10: curv2: there are 3 control points, not the 2");
    says(head + "cstype cardinal\ndeg 2\ncurv2 1 2 3\nparm u 0 1\nend\n",
         "a.obj:12: curv2: parameter u: cardinal curves are of degree 3");
    says(head + "cstype bmatrix\ncurv2 1 2 3\nparm u 0 1\nend\n", "a.obj:11: curv2: parameter u: bmatrix needs a step");
    says(head + "cstype bmatrix\nstep 1\nbmat u 1 2 3\ncurv2 1 2 3\nparm u 0 1\nend\n",
         "a.obj:13: curv2: parameter u: bmatrix of degree 1 needs a bmat of 4 numbers");
    // A basis matrix may make a weight that is none.
    says(
        "v 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nv 1 1 0 1\ncstype rat bmatrix\ndeg 1 1\nstep 1 1\nbmat u -1 0 0 0\nbmat v 1 "
        "-1 0 1\nsurf 0 1 0 1 1 2 3 4\nparm u 0 1\nparm v 0 1\nend\n",
        "a.obj:10: surf: the weight of control point 1");
}

TEST(ObjSurfaces, TakeNoMoreThanTheirLimit) {
    // Nine control points, used by so many loops.
    std::string text = kTrimmed.substr(0, kTrimmed.find("hole"));
    for (int k = 0; k < 1000; ++k) text += "hole 0 4 1\n";
    text += "end\n";
    EXPECT_TRUE(readNurbsObj(text, "a.obj"));
    const Expected<std::vector<NurbsSurface>> read = readNurbsObj(text, "a.obj", {.maxPoints = 20'000});
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().code, ErrorCode::kLimit);
    EXPECT_WORDS(read.error().message);
}

TEST(ObjSurfaces, AreReadOrRefusedWhateverTheBytes) {
    // Each prefix, and random changes: bytes, words of the language, lines gone or doubled.
    const std::string other =
        "v 0 0 0 1\nv 1 0 0 2\nv 2 1 0 1\nv 3 0 0 1\nv 0 1 0 1\nv 1 1 0 1\nv 2 2 0 1\nv 3 1 0 1\ncstype rat "
        "cardinal\ndeg 3 3\nsurf 0 1 0 1 1 2 3 4 5 6 7 8 1 2 3 4 5 6 7 8\n"
        "parm u 0 1\nparm v 0 1\nend\ncstype bmatrix\ndeg 3 1\nstep 1 1\nbmat u 1 -3 3 -1 0 3 -6 3 0 0 3 -3 0 0 0 "
        "1\nbmat v 1 -1 0 1\nsurf 0 1 0 1 1 2 3 4 5 6 7 8\nparm u 0 1\nparm v 0 1\nend\n";
    ASSERT_TRUE(readNurbsObj(other, "b")) << readNurbsObj(other, "b").error().message;
    std::size_t readable = 0;
    const auto take = [&](const std::string& text, const std::string& what) {
        const Expected<std::vector<NurbsSurface>> read = readNurbsObj(text, "x.obj", {.maxPoints = 100'000});
        if (!read) {
            EXPECT_EQ(read.error().message.rfind("x.obj:", 0), 0u) << what << read.error().message;
            return;
        }
        ++readable;
        for (const NurbsSurface& s : *read) {
            const ParameterRectangle& d = s.domain();
            for (const double t : {0.0, 0.3, 1.0}) {
                const NurbsPoint p = evaluate(s, d.u.lower + t * d.u.size(), d.v.lower + (1 - t) * d.v.size());
                EXPECT_TRUE(p.at.point.allFinite() && p.at.du.allFinite() && p.at.dv.allFinite() &&
                            p.at.normal.allFinite())
                    << what;
            }
        }
    };
    for (const std::string& text : {kTrimmed, other})
        for (std::size_t k = 0; k < text.size(); ++k) take(text.substr(0, k), fmt::format("first {} bytes: ", k));
    const std::array<std::string, 22> words = {"surf",
                                               "curv2",
                                               "curv",
                                               "end",
                                               "parm u",
                                               "trim 0 1 1",
                                               "hole",
                                               "-1",
                                               "0",
                                               "1e308",
                                               "-1e-308",
                                               "999999999",
                                               "nan",
                                               "deg 24 24",
                                               "deg 3",
                                               "cstype rat bezier",
                                               "cstype bspline",
                                               "\\\n",
                                               "#",
                                               "/",
                                               "\n",
                                               "1e30"};
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(20'000); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        std::string text = seed % 2 == 0 ? kTrimmed : other;
        for (std::size_t k = 0, changes = 1 + random() % 3; k < changes; ++k) {
            const std::size_t place = random() % text.size();
            switch (random() % 5) {
                case 0:
                    text[place] = static_cast<char>(random());
                    break;
                case 1:
                    text.insert(place, words[random() % words.size()]);
                    break;
                case 2:
                    text.erase(place, 1 + random() % 4);
                    break;
                case 3:
                    text.replace(place, std::min<std::size_t>(3, text.size() - place), words[random() % words.size()]);
                    break;
                default:
                    text.insert(place, text.substr(random() % text.size(), random() % 40));
                    break;
            }
        }
        take(text, fmt::format("TESSERA_SEED={}: ", seed));
    }
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_GT(readable, 1000u);
    }
}

}  // namespace
}  // namespace tessera
