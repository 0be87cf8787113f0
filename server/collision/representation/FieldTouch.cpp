#include "server/collision/representation/FieldTouch.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace tessera {

namespace {

/// Fewer cells are looked at one by one.
constexpr std::size_t kFewCells = 16;

bool apart(double low, double high, const HeightRange& range) {
    return low > range.high || high < range.low;
}

/// Grown; and never empty where numbers are missing.
Box grown(Box box, const Vec3d& by) {
    box.lower -= by;
    box.upper += by;
    return box;
}

}  // namespace

std::optional<FieldTouchFrame> FieldTouchFrame::make(const HeightField& field, bool fieldIsA, const Affine3d& a_T_b,
                                                     const Box& otherBounds) {
    if (fieldIsA) return FieldTouchFrame{a_T_b, true, a_T_b, Vec3d::Zero()};
    // A corner p of the field is mapped to q = L p + t + e. How far is M q + s, with M and s about the inverse, from p?
    // M L is not the identity to the last bit; e and the new roundings come on top.
    const Affine3d back = a_T_b.inverse(Eigen::Affine);
    if (!back.matrix().allFinite() || !a_T_b.matrix().allFinite()) return std::nullopt;
    const Mat3d size = a_T_b.linear().cwiseAbs(), backSize = back.linear().cwiseAbs();
    const Vec3d reach = reachOf(field.bounds()), shift = a_T_b.translation().cwiseAbs();
    const Mat3d residue = (back.linear() * a_T_b.linear() - Mat3d::Identity()).cwiseAbs();
    const Vec3d mapped = size * reach + shift + reachOf(otherBounds);
    const Vec3d slack = 1.01 * (residue * reach) + 0x1p-53 * 64 * (backSize * mapped + back.translation().cwiseAbs());
    if (!slack.allFinite() || !(residue.maxCoeff() < 1e-3)) return std::nullopt;
    return FieldTouchFrame{a_T_b, false, back, slack};
}

std::size_t levelFor(const HeightField& field, const HeightField::Cells& cells) {
    std::size_t l = field.levels().size() - 1;
    const auto blocks = [](const GridAxis::Cells& of, std::uint32_t size) {
        return (of.end - 1) / size - of.first / size + 1;
    };
    while (l > 0 && (blocks(cells.columns, field.levels()[l].cellColumns) > HeightField::kFanOut ||
                     blocks(cells.rows, field.levels()[l].cellRows) > HeightField::kFanOut))
        --l;
    return l;
}

double depthInHeights(const HeightField& field, const Box& box) {
    const HeightField::Cells cells = field.over(box);
    if (cells.empty()) return -1;
    const double low = box.lower[field.heightAxis()], high = box.upper[field.heightAxis()];
    double depth = -1;
    const auto meet = [&](const HeightRange& range) {
        if (range.low <= range.high && !apart(low, high, range))
            depth = std::max({depth, 0.0, std::min(high, range.high) - std::max(low, range.low)});
        return true;
    };
    if (cells.count() <= kFewCells) {
        meet(field.heightsAround(cells));
        return depth;
    }
    eachBlock(field, levelFor(field, cells), cells,
              [&](const HeightRange& range, const HeightField::Cells&) { return meet(range); });
    return depth;
}

bool FieldTouch::run() {
    if (other_.faceCount() == 0) return true;
    if (work_.exhausted()) return false;
    const bool complete = look();
    if (!done()) candidates_.decide(any_, pairs_);
    return complete;
}

bool FieldTouch::look() {
    PartBoxes boxes;
    other_.whole(boxes);
    if (!consider(boxes)) return false;
    while (!open_.empty() && !done()) {
        const Open next = open_.back();
        open_.pop_back();
        if (next.leaf) {
            LeafFaces leaf;
            other_.faces(next.part, leaf);
            for (unsigned i = 0; i < leaf.count && !done(); ++i)
                if (!meetFace(leaf.face[i])) return false;
        } else {
            other_.open(next.part, boxes);
            if (!consider(boxes)) return false;
        }
    }
    return true;
}

bool FieldTouch::consider(const PartBoxes& boxes) {
    const std::size_t first = open_.size();
    ++work_.boxTests;
    for (unsigned i = 0; i < boxes.count; ++i) {
        const Box box = grown(boxes.box(i), frame_.slack);
        if (!field_.bounds().overlaps(box) && (box.lower.array() <= box.upper.array()).all()) continue;
        ++work_.boxTests;
        const double depth = depthInHeights(field_, box);
        if (depth >= 0) open_.push_back({depth, boxes.part[i], boxes.leaf[i]});
    }
    // What is deepest in the heights is the likeliest to meet them.
    if (any_)
        std::sort(open_.begin() + static_cast<std::ptrdiff_t>(first), open_.end(), [](const Open& x, const Open& y) {
            return x.depth != y.depth ? x.depth < y.depth : x.part < y.part;
        });
    return !work_.exhausted();
}

bool FieldTouch::meetFace(std::uint32_t number) {
    Face face{.number = number, .own = other_.triangle(number)};
    face.here = transformed(frame_.field_T_other, face.own);
    for (const Vec3d& p : face.here) face.box.extend(p);
    face.box = grown(face.box, frame_.slack);
    ++work_.triangleTests;
    const HeightField::Cells cells = field_.over(face.box);
    if (cells.empty()) return !work_.exhausted();
    if (cells.count() <= kFewCells) return eachCell(face, cells);
    return walk(face, levelFor(field_, cells), cells);
}

bool FieldTouch::walk(Face& face, std::size_t level, const HeightField::Cells& cells) {
    ++work_.boxTests;
    if (work_.exhausted()) return false;
    if (face.axisCount == 0) addAxes(face);
    const int h = field_.heightAxis();
    bool complete = true;
    eachBlock(field_, level, cells, [&](const HeightRange& range, const HeightField::Cells& below) {
        if (!(range.low <= range.high) || apart(face.box.lower[h], face.box.upper[h], range)) return true;
        if (separated(face, below, range.low, range.high)) return true;
        complete = level + 1 < field_.levels().size() ? walk(face, level + 1, below) : eachCell(face, below);
        return complete && !done();
    });
    return complete;
}

void FieldTouch::addAxes(Face& face) const {
    const Triangle& t = face.here;
    const Vec3d up = Vec3d::Unit(field_.heightAxis());
    const Vec3d reach = reachOf(field_.bounds()).cwiseMax(reachOf(face.box));
    for (const Vec3d& n : {Vec3d((t[1] - t[0]).cross(t[2] - t[0])), Vec3d((t[1] - t[0]).cross(up)),
                           Vec3d((t[2] - t[1]).cross(up)), Vec3d((t[0] - t[2]).cross(up))}) {
        // Any direction may separate, so its own rounding does not matter; that of what is projected does.
        const double p = n.dot(t[1] - t[0]), q = n.dot(t[2] - t[0]);
        const double error = n.cwiseAbs().dot(0x1p-53 * 64 * reach + 2 * frame_.slack);
        face.axes[face.axisCount++] = {n, std::min({0.0, p, q}) - error, std::max({0.0, p, q}) + error};
    }
}

bool FieldTouch::separated(const Face& face, const HeightField::Cells& cells, double low, double high) const {
    Vec3d lower, upper;
    lower[field_.columnAxis()] = field_.columns()[cells.columns.first];
    upper[field_.columnAxis()] = field_.columns()[cells.columns.end];
    lower[field_.rowAxis()] = field_.rows()[cells.rows.first];
    upper[field_.rowAxis()] = field_.rows()[cells.rows.end];
    lower[field_.heightAxis()] = low;
    upper[field_.heightAxis()] = high;
    const Vec3d middle = 0.5 * (lower + upper) - face.here[0], half = 0.5 * (upper - lower);
    for (unsigned i = 0; i < face.axisCount; ++i) {
        const Face::Axis& axis = face.axes[i];
        const double at = axis.n.dot(middle), reach = axis.n.cwiseAbs().dot(half);
        if (at - reach > axis.high || at + reach < axis.low) return true;
    }
    return false;
}

bool FieldTouch::eachCell(const Face& face, const HeightField::Cells& cells) {
    for (std::uint32_t row = cells.rows.first; row < cells.rows.end && !done(); ++row)
        for (std::uint32_t column = cells.columns.first; column < cells.columns.end; ++column)
            meetCell(face, column, row);
    return !work_.exhausted();
}

void FieldTouch::meetCell(const Face& face, std::uint32_t column, std::uint32_t row) {
    // Deciding eight costs as much as deciding one; to wait for many would cost whoever looks for one more.
    constexpr std::uint32_t kEnoughForAny = 6;
    const int h = field_.heightAxis();
    const double low = face.box.lower[h], high = face.box.upper[h];
    const std::array<double, 4> heights = field_.heightsOf(column, row);
    HeightRange all;
    for (const double height : heights) all.extend(height);
    if (apart(low, high, all)) return;
    if (face.axisCount > 0 && separated(face, {{column, column + 1}, {row, row + 1}}, all.low, all.high)) return;
    for (unsigned half = 0; half < 2; ++half) {
        if (!field_.has(column, row, half)) continue;
        HeightRange range;
        for (const std::uint8_t corner : field_.cornersOf(column, row, half)) range.extend(heights[corner]);
        if (apart(low, high, range)) continue;
        ++work_.triangleTests;
        const Triangle mine = field_.triangleAt(column, row, half);
        const std::uint32_t own = field_.faceOf(column, row, half);
        if (frame_.fieldIsA)
            candidates_.add({own, face.number}, mine, face.own);
        else
            candidates_.add({face.number, own}, face.own, mine);
        if (candidates_.count() >= (any_ ? kEnoughForAny : PairDecider::kRoom)) candidates_.decide(any_, pairs_);
    }
}

}  // namespace tessera
