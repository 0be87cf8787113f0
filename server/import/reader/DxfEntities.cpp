// Shapes of DXF: what each kind of entity becomes.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "common/geometry/Primitives.h"
#include "server/import/reader/DxfHatch.h"
#include "server/import/reader/DxfReader.h"

namespace tessera {
namespace {

constexpr double kDegrees = std::numbers::pi / 180;
/// Beyond, numbers mean nothing.
constexpr double kFarthest = 1e12;
/// With more curves are coarser.
constexpr std::size_t kManyCurvePoints = 2'000'000;

Mat3d frameOf(const DxfRecord& record) {
    return dxfFrame(record.point(210, Vec3d::UnitZ()));
}

void turnAll(const Mat3d& frame, DxfPath& path) {
    for (Vec3d& point : path) point = frame * point;
}

}  // namespace

std::size_t DxfReader::curvePointsOf(const DxfRecord& record, const DxfChords& chords) {
    const auto turn = [&](double sweep) -> std::size_t {
        if (!std::isfinite(sweep)) return 0;
        const double wanted = std::ceil(std::abs(sweep) / (2 * std::numbers::pi) * chords.perTurn - 1e-9);
        return static_cast<std::size_t>(std::clamp<double>(wanted, chords.fewest, chords.perTurn)) + 1;
    };
    const auto count = [&](int code) {
        return static_cast<std::size_t>(std::ranges::count(record.groups, code, &DxfGroup::code));
    };
    const auto perTurn = static_cast<std::size_t>(chords.perTurn), perSpan = static_cast<std::size_t>(chords.perSpan);
    const auto bulges = [&] {
        const auto isBulge = [](const DxfGroup& group) { return group.code == 42 && group.number() != 0; };
        return static_cast<std::size_t>(std::ranges::count_if(record.groups, isBulge)) * perTurn / 2;
    };
    const std::string_view type = record.type;
    if (type == "CIRCLE") return perTurn + 1;
    if (type == "ARC") return turn(dxfSweep(record.number(50, 0) * kDegrees, record.number(51, 0) * kDegrees));
    if (type == "ELLIPSE") return turn(dxfSweep(record.number(41, 0), record.number(42, 2 * std::numbers::pi)));
    if (type == "SPLINE") return (count(10) + count(11)) * perSpan;
    if (type == "LWPOLYLINE" || type == "VERTEX") return bulges();
    if (type == "HATCH") return record.integer(70, 0) == 1 ? count(10) + bulges() : 0;
    return 0;
}

/// A small drawing has room for all its curves, whatever they are.
void DxfReader::lookAhead() {
    constexpr std::size_t kSmall = std::size_t{1} << 20;
    if (fileBytes_ < kSmall) return;
    DxfGroups& groups = document_.groups();
    const DxfGroups::Mark here = groups.mark();
    for (DxfRecord record; groups.next(record) && record.type != "ENDSEC" && record.type != "SECTION";) {
        coarseAhead_ += curvePointsOf(record, kCoarseChords);
        roughAhead_ += curvePointsOf(record, kRoughChords);
    }
    groups.goTo(here);
}

void DxfReader::pass(const DxfRecord& record) {
    if (!open_.empty() || roughAhead_ == 0) return;
    coarseAhead_ -= std::min(coarseAhead_, curvePointsOf(record, kCoarseChords));
    roughAhead_ -= std::min(roughAhead_, curvePointsOf(record, kRoughChords));
}

const DxfChords& DxfReader::chords(const DxfRecord& record, std::optional<std::size_t> halfTurns) {
    static const DxfChords kFine;
    // What follows shall have room too: what was counted ahead, and of blocks, which are read as often as they look
    // otherwise, as much as came so far. Once rough they stay so: they look alike.
    const auto at = static_cast<double>(std::clamp<std::size_t>(document_.groups().mark().at, 1, fileBytes_ + 1));
    const double left = std::max(static_cast<double>(fileBytes_) - at, 0.0) / at;
    const auto pointsOf = [&](const DxfChords& chords) {
        return curvePoints_ +
               (halfTurns ? *halfTurns * static_cast<std::size_t>(chords.perTurn) / 2 : curvePointsOf(record, chords));
    };
    const auto fits = [&](const DxfChords& chords, std::size_t ahead, double ofBlocks) {
        return static_cast<double>(pointsOf(chords) + ahead) + ofBlocks * left <= static_cast<double>(mostCurvePoints_);
    };
    const auto ofBlocks = static_cast<double>(coarseOfBlocks_);
    const double share = double{kRoughChords.perTurn} / kCoarseChords.perTurn;
    if (!areRough_ && pointsOf(kFine) < kManyCurvePoints && fits(kFine, roughAhead_, share * ofBlocks)) return kFine;
    if (!areRough_ && fits(kCoarseChords, coarseAhead_, ofBlocks)) return kCoarseChords;
    if (!std::exchange(areRough_, true))
        scene_.note(fmt::format("of its very many curves some are of {} chords a turn (save the drawing in parts)",
                                kRoughChords.perTurn));
    return kRoughChords;
}

void DxfReader::countCurve(std::size_t points, const DxfChords& chords) {
    curvePoints_ += points;
    if (!open_.empty())
        coarseOfBlocks_ +=
            points * static_cast<std::size_t>(kCoarseChords.perTurn) / static_cast<std::size_t>(chords.perTurn);
}

bool DxfReader::hasRoomForCurve(const DxfRecord& record, Reading& to) {
    if (curvePoints_ < mostCurvePoints_) return true;
    leftOut(curvesBeyond_);
    (void)bucketOf(record, to);  // its block looks as if it were there
    return false;
}

bool DxfReader::isSound(std::span<const Vec3d> path) {
    const bool sound =
        std::ranges::all_of(path, [](const Vec3d& p) { return p.cwiseAbs().maxCoeff() < kFarthest && p.allFinite(); });
    if (!sound) addUnsound();
    return sound;
}

void DxfReader::addUnsound() {
    if (unsound_++ == 0) firstUnsound_ = document_.groups().place();
}

void DxfReader::addPath(const DxfRecord& record, std::span<const Vec3d> path, bool closed, Reading& to) {
    const double thick = record.number(39, 0);
    Vec3d thickness = Vec3d::Zero();
    if (std::abs(thick) > 0 && std::abs(thick) < kFarthest) thickness = thick * frameOf(record).col(2);
    if (isSound(path)) bucketOf(record, to).addPath(path, closed, thickness);
}

void DxfReader::addLetters(const DxfRecord& record, std::optional<DxfLetters> letters, Reading& to) {
    if (!letters) return;
    if (letters->sheared) leftOut("the slant of letters");
    if (letters->isCut)
        leftOut(fmt::format("ends of texts longer than {} bytes, or than lines of 1000 letters (part them)",
                            kMostDxfTextBytes));
    const std::string& text = letters->text.text();
    const auto count = static_cast<std::size_t>(std::ranges::count_if(text, [](char c) { return (c & 0xc0) != 0x80; }));
    if (count > mostLetters_ - std::min(letters_, mostLetters_))
        return leftOut(fmt::format("texts beyond {} letters (save the drawing in parts)", mostLetters_));
    if (!takeRoomFor(1, 0)) return;
    letters_ += count;
    to.content.letters += count;
    bucketOf(record, to).addLetters(std::move(*letters));
}

bool DxfReader::addShape(const DxfRecord& record, Reading& to) {
    const std::string_view type = record.type;
    if (type == "LINE") {
        addPath(record, std::array{record.point(10), record.point(11)}, false, to);
    } else if (type == "POINT") {
        const DxfPath point = {record.point(10)};
        if (isSound(point)) bucketOf(record, to).addPoint(point.front());
    } else if (type == "CIRCLE" || type == "ARC" || type == "ELLIPSE" || type == "SPLINE") {
        addCurve(record, to);
    } else if (type == "LWPOLYLINE") {
        addLightPolyline(record, to);
    } else if (type == "POLYLINE") {
        addPolyline(record, to);
    } else if (type == "LEADER") {
        addPath(record, record.points(10), false, to);
    } else if (type == "3DFACE" || type == "SOLID" || type == "TRACE") {
        addSolid(record, to);
    } else if (type == "MESH") {
        addMesh(record, to);
    } else if (type == "HATCH") {
        addHatch(record, to);
    } else if (type == "TEXT") {
        addLetters(record, dxfLineOfText(record, document_), to);
    } else if (type == "MTEXT") {
        addLetters(record, dxfTextBlock(record, document_), to);
    } else {
        return false;
    }
    return true;
}

void DxfReader::addCurve(const DxfRecord& record, Reading& to) {
    if (!hasRoomForCurve(record, to)) return;
    const DxfChords& chords = this->chords(record);
    DxfPath path;
    const Vec3d center = record.point(10);
    if (record.type == "SPLINE") {
        DxfSpline spline;
        spline.degree = static_cast<std::size_t>(std::clamp<std::int64_t>(record.integer(71, 3), 0, 99));
        spline.knots = record.numbers(40);
        spline.weights = record.numbers(41);
        spline.points = record.points(10);
        spline.through = record.points(11);
        spline.closed = (record.integer(70, 0) & 1) != 0;
        path = dxfSplinePath(spline, chords);
        if (path.empty()) return addUnsound();
    } else if (record.type == "ELLIPSE") {
        const Vec3d major = record.point(11), normal = frameOf(record).col(2);
        const double start = record.number(41, 0), end = record.number(42, 2 * std::numbers::pi);
        addDxfEllipse(path, center, major, record.number(40, 1) * normal.cross(major), start, dxfSweep(start, end),
                      chords);
    } else {
        const double radius = record.number(40, 0);
        const bool whole = record.type == "CIRCLE";
        const double start = whole ? 0 : record.number(50, 0) * kDegrees;
        const double sweep = whole ? 2 * std::numbers::pi : dxfSweep(start, record.number(51, 0) * kDegrees);
        addDxfEllipse(path, center, Vec3d(radius, 0, 0), Vec3d(0, radius, 0), start, sweep, chords);
        turnAll(frameOf(record), path);
    }
    countCurve(path.size(), chords);
    addPath(record, path, false, to);
}

void DxfReader::addLightPolyline(const DxfRecord& record, Reading& to) {
    std::vector<Vec3d> corners;
    std::vector<double> bulges;
    const double z = record.number(38, 0);
    for (const DxfGroup& group : record.groups) {
        if (group.code == 10) {
            corners.emplace_back(group.number(), 0, z);
            bulges.push_back(0);
        }
        if (corners.empty()) continue;
        if (group.code == 20) corners.back().y() = group.number();
        if (group.code == 42) bulges.back() = group.number();
    }
    if (!corners.empty()) addBulged(record, corners, bulges, (record.integer(70, 0) & 1) != 0, to);
}

void DxfReader::addBulged(const DxfRecord& record, std::span<const Vec3d> corners, std::span<const double> bulges,
                          bool closed, Reading& to) {
    const auto arcs = static_cast<std::size_t>(std::ranges::count_if(bulges, [](double bulge) { return bulge != 0; }));
    if (arcs > 0 && !hasRoomForCurve(record, to)) return;
    const DxfChords& chords = this->chords(record, arcs);
    DxfPath path{corners.front()};
    const std::size_t sides = closed ? corners.size() : corners.size() - 1;
    for (std::size_t i = 0; i < sides; ++i) addDxfBulge(path, corners[(i + 1) % corners.size()], bulges[i], chords);
    if (path.size() > corners.size() + 1) countCurve(path.size(), chords);
    turnAll(frameOf(record), path);
    addPath(record, path, false, to);
}

void DxfReader::addPolyline(const DxfRecord& record, Reading& to) {
    constexpr std::int64_t kClosed = 1, kSpline = 4, k3d = 8, kGrid = 16, kFaces = 64;
    constexpr std::int64_t kFrame = 16, kPlace = 64, kFace = 128;  // of a VERTEX
    const std::int64_t flags = record.integer(70, 0);
    const bool flat = (flags & (k3d | kGrid | kFaces)) == 0;
    const double z = record.number(30, 0);
    std::vector<Vec3d> vertices;
    std::vector<double> bulges;
    std::vector<std::uint32_t> corners, sizes;
    DxfGroups& groups = document_.groups();
    DxfGroups::Mark before = groups.mark();
    for (DxfRecord vertex; groups.next(vertex); before = groups.mark()) {
        if (vertex.type == "SEQEND") break;
        if (vertex.type != "VERTEX") {
            groups.goTo(before);
            break;
        }
        pass(vertex);
        const std::int64_t kind = vertex.integer(70, 0);
        if ((flags & kFaces) != 0 && (kind & kFace) != 0 && (kind & kPlace) == 0) {
            const std::size_t first = corners.size();
            for (int code = 71; code <= 74; ++code)  // below zero: that edge is not to be seen
                if (const std::int64_t corner = std::abs(vertex.integer(code, 0)); corner != 0)
                    corners.push_back(static_cast<std::uint32_t>(std::min<std::int64_t>(corner - 1, 0xffffffff)));
            sizes.push_back(static_cast<std::uint32_t>(corners.size() - first));
            continue;
        }
        if ((kind & kFrame) != 0 && (flags & kSpline) != 0) continue;
        vertices.push_back(vertex.point(10));
        if (flat) vertices.back().z() = z;
        bulges.push_back(vertex.number(42, 0));
    }
    if ((flags & kFaces) != 0) return addPolygons(record, vertices, corners, sizes, to);
    if ((flags & kGrid) != 0) return addGrid(record, vertices, (flags & kSpline) != 0, to);
    if (vertices.empty()) return;
    const bool closed = (flags & kClosed) != 0;
    if (!flat) return addPath(record, vertices, closed, to);
    addBulged(record, vertices, bulges, closed, to);
}

/// Rows of vertices: M of them, each of N.
void DxfReader::addGrid(const DxfRecord& record, const std::vector<Vec3d>& vertices, bool smooth, Reading& to) {
    constexpr std::int64_t kClosedM = 1, kClosedN = 32;
    const std::int64_t flags = record.integer(70, 0);
    const auto count = [&](int code, int smoothCode) {
        return static_cast<std::size_t>(
            std::clamp<std::int64_t>(record.integer(smooth ? smoothCode : code, 0), 0, 0xffff));
    };
    const std::size_t m = count(71, 73), n = count(72, 74);
    if (m * n != vertices.size() || m < 2 || n < 2) {
        addUnsound();
        return;
    }
    std::vector<std::uint32_t> corners, sizes;
    for (std::size_t i = 0; i < ((flags & kClosedM) != 0 ? m : m - 1); ++i)
        for (std::size_t j = 0; j < ((flags & kClosedN) != 0 ? n : n - 1); ++j) {
            const std::size_t nextI = (i + 1) % m, nextJ = (j + 1) % n;
            for (const std::size_t corner : {i * n + j, i * n + nextJ, nextI * n + nextJ, nextI * n + j})
                corners.push_back(static_cast<std::uint32_t>(corner));
            sizes.push_back(4);
        }
    addPolygons(record, vertices, corners, sizes, to);
}

void DxfReader::addPolygons(const DxfRecord& record, const std::vector<Vec3d>& vertices,
                            const std::vector<std::uint32_t>& corners, const std::vector<std::uint32_t>& sizes,
                            Reading& to) {
    if (!isSound(vertices)) return;
    std::vector<std::uint32_t> good, lengths;
    std::size_t at = 0;
    for (const std::uint32_t size : sizes) {
        const std::span<const std::uint32_t> face = std::span(corners).subspan(at, size);
        at += size;
        if (!std::ranges::all_of(face, [&](std::uint32_t corner) { return corner < vertices.size(); })) {
            leftOut("faces of vertices that do not exist");
            continue;
        }
        if (size == 2) addPath(record, std::array{vertices[face[0]], vertices[face[1]]}, false, to);
        if (size < 3) continue;
        good.insert(good.end(), face.begin(), face.end());
        lengths.push_back(size);
    }
    if (lengths.empty()) return;
    std::vector<float> positions;
    for (const Vec3d& vertex : vertices)
        for (int i = 0; i < 3; ++i) positions.push_back(static_cast<float>(vertex[i] - vertices.front()[i]));
    const Expected<std::vector<std::uint32_t>> triangles =
        assembleRuns({.kind = RunKind::kPolygons, .positions = positions, .indices = good, .lengths = lengths});
    if (!triangles) return leftOut("meshes with polygons of too many corners");
    bucketOf(record, to).addTriangles(vertices, *triangles);
}

/// A MESH: counts, and as many groups behind each; the counts are not believed.
void DxfReader::addMesh(const DxfRecord& record, Reading& to) {
    std::vector<Vec3d> vertices;
    std::vector<std::uint32_t> corners, sizes;
    std::int64_t facesLeft = 0, cornersLeft = 0;
    bool inFaces = false;
    for (const DxfGroup& group : record.groups) {
        if (group.code == 10) vertices.emplace_back(group.number(), 0, 0);
        if (group.code == 20 && !vertices.empty()) vertices.back().y() = group.number();
        if (group.code == 30 && !vertices.empty()) vertices.back().z() = group.number();
        if (group.code == 93) {
            inFaces = true;
            facesLeft = group.integer();
        } else if (group.code == 94) {
            inFaces = false;
        } else if (group.code == 90 && inFaces && facesLeft > 0) {
            --facesLeft;
            if (cornersLeft == 0) {
                cornersLeft = std::clamp<std::int64_t>(group.integer(), 0, facesLeft);
                sizes.push_back(0);
            } else {
                --cornersLeft;
                ++sizes.back();
                corners.push_back(static_cast<std::uint32_t>(std::clamp<std::int64_t>(group.integer(), 0, 0xffffffff)));
            }
        }
    }
    if (record.integer(91, 0) > 0) leftOut("the smoothness of meshes, which are shown as they are controlled,");
    addPolygons(record, vertices, corners, sizes, to);
}

void DxfReader::addHatch(const DxfRecord& record, Reading& to) {
    if (record.integer(70, 0) != 1) return leftOut("patterns of hatches");
    if (record.integer(450, 0) != 0) leftOut("gradients of hatches, which have one colour,");
    if (!hasRoomForCurve(record, to)) return;
    const DxfChords& chords = this->chords(record);
    const std::vector<DxfPath> rings = dxfHatchRings(record, chords);
    for (const DxfPath& ring : rings)
        if (!isSound(ring)) return;
    Expected<DxfFill> fill = dxfFilled(rings);
    if (!fill) return leftOut("hatches with too many corners");
    turnAll(frameOf(record), fill->corners);
    countCurve(fill->corners.size(), chords);
    if (!fill->triangles.empty()) bucketOf(record, to).addTriangles(fill->corners, fill->triangles);
}

/// A SOLID or TRACE has its last two corners the other way about. Their thickness makes a box of them.
void DxfReader::addSolid(const DxfRecord& record, Reading& to) {
    DxfPath corners = {record.point(10), record.point(11), record.point(12)};
    corners.push_back(record.find(13) ? record.point(13) : corners.back());
    const bool face = record.type == "3DFACE";
    if (!face) {
        std::swap(corners[2], corners[3]);
        turnAll(frameOf(record), corners);
    }
    if (!isSound(corners)) return;
    if (corners[3] == corners[2]) corners.pop_back();
    DxfBucket& bucket = bucketOf(record, to);
    bucket.addFace(corners);
    const double thick = face ? 0 : record.number(39, 0);
    if (!(std::abs(thick) > 0 && std::abs(thick) < kFarthest)) return;
    const Vec3d thickness = thick * frameOf(record).col(2);
    bucket.addPath(corners, true, thickness);
    for (Vec3d& corner : corners) corner += thickness;
    bucket.addFace(corners);
}

}  // namespace tessera
