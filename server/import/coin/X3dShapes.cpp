// Geometry that X3D has and VRML has not, out of what VRML has.

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "server/import/coin/X3dDocument.h"

namespace tessera {
namespace {

std::vector<long> wholesOf(std::string_view text) {
    std::vector<long> wholes;
    for (const double number : numbersOf(text))
        wholes.push_back(std::abs(number) < 1e9 ? static_cast<long>(number) : -1);
    return wholes;
}

}  // namespace

std::vector<double> numbersOf(std::string_view text) {
    std::vector<double> numbers;
    while (!text.empty()) {
        const std::size_t begin = text.find_first_not_of(" \t\r\n,");
        if (begin == text.npos) break;
        text.remove_prefix(begin);
        if (text.front() == '+') text.remove_prefix(1);
        double number = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
        if (error != std::errc()) break;
        numbers.push_back(number);
        text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    }
    return numbers;
}

/// How many there are in its Coordinate.
std::size_t X3dWriter::pointsOf(const pugi::xml_node& geometry) const {
    for (pugi::xml_node child : geometry.children()) {
        if (child.name() != std::string_view("Coordinate") && child.name() != std::string_view("CoordinateDouble") &&
            child.attribute("containerField").value() != std::string_view("coord"))
            continue;
        if (const pugi::xml_attribute use = child.attribute("USE"))
            if (const auto named = named_.find(use.value()); named != named_.end()) child = named->second;
        return numbersOf(child.attribute("point").value()).size() / 3;
    }
    return 0;
}

void X3dWriter::faces(const pugi::xml_node& element, const std::vector<std::vector<long>>& polygons,
                      std::size_t depth) {
    define(element);
    out_ += "IndexedFaceSet { coordIndex [";
    for (const std::vector<long>& polygon : polygons) {
        for (const long corner : polygon) out_ += fmt::format("{} ", corner);
        out_ += "-1 ";
    }
    out_ += "]";
    const bool smooth = element.attribute("normalPerVertex").value() != std::string_view("false") &&
                        element.attribute("normalPerVertex").value() != std::string_view("FALSE");
    if (smooth) out_ += " creaseAngle 3.15";
    body(element, "IndexedFaceSet", depth, {"index", "stripCount", "fanCount", "creaseAngle"});
    out_ += "}";
}

void X3dWriter::flatShape(const pugi::xml_node& element, const char* kind,
                          const std::vector<std::pair<double, double>>& points, const std::string& index) {
    define(element);
    out_ += fmt::format("{} {{ coord Coordinate {{ point [", kind);
    for (const auto& [x, y] : points) out_ += fmt::format("{} {} 0 ", x, y);
    out_ += "] }";
    if (!index.empty()) out_ += " coordIndex [" + index + "]";
    // Unlike VRML's faces X3D's flat ones have two sides, unless they say otherwise.
    const std::string_view solid = element.attribute("solid").value();
    if (kind == std::string_view("IndexedFaceSet") && solid != "true" && solid != "TRUE") out_ += " solid FALSE";
    out_ += " }";
}

/// Geometry that VRML does not have, out of what it has.
bool X3dWriter::madeUp(const pugi::xml_node& element, std::size_t depth) {
    constexpr std::size_t kMost = 50'000'000;
    const std::string kind = element.name();
    const auto number = [&](const char* name, double otherwise) {
        const std::vector<double> all = numbersOf(element.attribute(name).value());
        return all.empty() ? otherwise : all.front();
    };
    std::vector<std::vector<long>> polygons;
    const auto each = [&](const std::vector<long>& corners, std::size_t size) {
        for (std::size_t i = 0; i + size <= corners.size(); i += size)
            polygons.emplace_back(corners.begin() + static_cast<std::ptrdiff_t>(i),
                                  corners.begin() + static_cast<std::ptrdiff_t>(i + size));
    };
    const auto strip = [&](const std::vector<long>& run) {
        for (std::size_t i = 0; i + 2 < run.size(); ++i)
            polygons.push_back(i % 2 == 0 ? std::vector<long>{run[i], run[i + 1], run[i + 2]}
                                          : std::vector<long>{run[i + 1], run[i], run[i + 2]});
    };
    const auto fan = [&](const std::vector<long>& run) {
        for (std::size_t i = 1; i + 1 < run.size(); ++i) polygons.push_back({run[0], run[i], run[i + 1]});
    };
    const auto asTheyStand = [&] {
        std::vector<long> all(std::min(pointsOf(element), kMost));
        for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<long>(i);
        return all;
    };
    const auto inRuns = [&](const std::vector<long>& all, const char* counts) {
        std::vector<std::vector<long>> runs;
        std::size_t at = 0;
        for (const long count : wholesOf(element.attribute(counts).value())) {
            if (count < 0 || static_cast<std::size_t>(count) > all.size() - at) break;
            runs.emplace_back(all.begin() + static_cast<std::ptrdiff_t>(at),
                              all.begin() + static_cast<std::ptrdiff_t>(at) + count);
            at += static_cast<std::size_t>(count);
        }
        return runs;
    };
    const auto inPieces = [&] {
        std::vector<std::vector<long>> runs(1);
        for (const long corner : wholesOf(element.attribute("index").value()))
            if (corner < 0)
                runs.emplace_back();
            else
                runs.back().push_back(corner);
        return runs;
    };
    const auto arc = [&](double radius, double from, double to) {
        constexpr int kSteps = 64;
        std::vector<std::pair<double, double>> points;
        for (int i = 0; i <= kSteps; ++i) {
            const double angle = from + (to - from) * i / kSteps;
            points.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
        }
        return points;
    };
    const auto inOrder = [](std::size_t count, bool closed) {
        std::string index;
        for (std::size_t i = 0; i < count; ++i) index += fmt::format("{} ", i);
        return index + (closed ? "0" : "");
    };
    const auto pairs = [&](const char* name) {
        const std::vector<double> all = numbersOf(element.attribute(name).value());
        std::vector<std::pair<double, double>> points;
        for (std::size_t i = 0; i + 1 < all.size(); i += 2) points.emplace_back(all[i], all[i + 1]);
        return points;
    };
    constexpr double kTurn = 2 * std::numbers::pi;
    if (kind == "IndexedTriangleSet") {
        each(wholesOf(element.attribute("index").value()), 3);
    } else if (kind == "IndexedQuadSet") {
        each(wholesOf(element.attribute("index").value()), 4);
    } else if (kind == "TriangleSet") {
        each(asTheyStand(), 3);
    } else if (kind == "QuadSet") {
        each(asTheyStand(), 4);
    } else if (kind == "TriangleStripSet") {
        for (const auto& run : inRuns(asTheyStand(), "stripCount")) strip(run);
    } else if (kind == "TriangleFanSet") {
        for (const auto& run : inRuns(asTheyStand(), "fanCount")) fan(run);
    } else if (kind == "IndexedTriangleStripSet") {
        for (const auto& run : inPieces()) strip(run);
    } else if (kind == "IndexedTriangleFanSet") {
        for (const auto& run : inPieces()) fan(run);
    } else if (kind == "LineSet") {
        define(element);
        out_ += "IndexedLineSet { coordIndex [";
        for (const auto& run : inRuns(asTheyStand(), "vertexCount")) {
            for (const long corner : run) out_ += fmt::format("{} ", corner);
            out_ += "-1 ";
        }
        out_ += "]";
        body(element, "IndexedLineSet", depth, {"vertexCount"});
        out_ += "}";
        return true;
    } else if (kind == "Rectangle2D") {
        std::vector<double> size = numbersOf(element.attribute("size").value());
        if (size.size() < 2) size = {2, 2};
        const double x = size[0] / 2, y = size[1] / 2;
        flatShape(element, "IndexedFaceSet", {{-x, -y}, {x, -y}, {x, y}, {-x, y}}, "0 1 2 3");
        return true;
    } else if (kind == "Disk2D") {
        const double inner = number("innerRadius", 0), outer = number("outerRadius", 1);
        std::vector<std::pair<double, double>> points = arc(outer, 0, kTurn);
        std::string index;
        if (inner > 0) {
            const std::size_t count = points.size();
            for (const auto& point : arc(inner, 0, kTurn)) points.push_back(point);
            for (std::size_t i = 0; i + 1 < count; ++i)
                index += fmt::format("{} {} {} {} -1 ", i, i + 1, count + i + 1, count + i);
        } else {
            index = inOrder(points.size() - 1, false);
        }
        flatShape(element, "IndexedFaceSet", points, index);
        return true;
    } else if (kind == "Circle2D" || kind == "Arc2D") {
        const auto points = kind == "Circle2D" ? arc(number("radius", 1), 0, kTurn)
                                               : arc(number("radius", 1), number("startAngle", 0),
                                                     number("endAngle", std::numbers::pi / 2));
        flatShape(element, "IndexedLineSet", points, inOrder(points.size(), false));
        return true;
    } else if (kind == "ArcClose2D") {
        auto points = arc(number("radius", 1), number("startAngle", 0), number("endAngle", std::numbers::pi / 2));
        if (element.attribute("closureType").value() != std::string_view("CHORD")) points.emplace_back(0, 0);
        flatShape(element, "IndexedFaceSet", points, inOrder(points.size(), false));
        return true;
    } else if (kind == "Polyline2D") {
        const auto points = pairs("lineSegments");
        flatShape(element, "IndexedLineSet", points, inOrder(points.size(), false));
        return true;
    } else if (kind == "Polypoint2D") {
        flatShape(element, "PointSet", pairs("point"), "");
        return true;
    } else if (kind == "TriangleSet2D") {
        const auto points = pairs("vertices");
        std::string index;
        for (std::size_t i = 0; i + 2 < points.size(); i += 3) index += fmt::format("{} {} {} -1 ", i, i + 1, i + 2);
        flatShape(element, "IndexedFaceSet", points, index);
        return true;
    } else {
        return false;
    }
    faces(element, polygons, depth);
    return true;
}

}  // namespace tessera
