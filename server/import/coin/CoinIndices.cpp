#include "server/import/coin/CoinIndices.h"

#include <Inventor/VRMLnodes/SoVRMLColor.h>
#include <Inventor/VRMLnodes/SoVRMLCoordinate.h>
#include <Inventor/VRMLnodes/SoVRMLElevationGrid.h>
#include <Inventor/VRMLnodes/SoVRMLIndexedFaceSet.h>
#include <Inventor/VRMLnodes/SoVRMLIndexedLineSet.h>
#include <Inventor/VRMLnodes/SoVRMLNormal.h>
#include <Inventor/VRMLnodes/SoVRMLPointSet.h>
#include <Inventor/VRMLnodes/SoVRMLTextureCoordinate.h>
#include <Inventor/elements/SoNormalBindingElement.h>
#include <Inventor/elements/SoTextureCoordinateElement.h>
#include <Inventor/nodes/SoFaceSet.h>
#include <Inventor/nodes/SoIndexedShape.h>
#include <Inventor/nodes/SoLineSet.h>
#include <Inventor/nodes/SoNonIndexedShape.h>
#include <Inventor/nodes/SoPointSet.h>
#include <Inventor/nodes/SoQuadMesh.h>
#include <Inventor/nodes/SoVertexProperty.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "server/import/coin/CoinNodes.h"

namespace tessera {
namespace {

std::vector<int32_t> listOf(const SoMFInt32& field) {
    const int32_t* const values = field.getValues(0);
    return {values, values + field.getNum()};
}

void write(SoMFInt32& field, const std::vector<int32_t>& numbers) {
    field.setNum(static_cast<int>(numbers.size()));
    field.setValues(0, static_cast<int>(numbers.size()), numbers.data());
}

/// Pieces end at -1. A piece with a bad corner gets its first good one, or 0, everywhere. How many such there were.
std::size_t collapseBadPieces(std::vector<int32_t>& corners, int count) {
    const auto isBad = [&](int32_t corner) { return corner < -1 || corner >= count; };
    std::size_t bad = 0;
    for (std::size_t begin = 0; begin < corners.size();) {
        std::size_t end = begin;
        while (end < corners.size() && corners[end] != -1) ++end;
        const auto from = corners.begin() + static_cast<std::ptrdiff_t>(begin);
        const auto to = corners.begin() + static_cast<std::ptrdiff_t>(end);
        if (std::any_of(from, to, isBad)) {
            ++bad;
            std::fill(from, to, 0);
        }
        begin = end + 1;
    }
    return bad;
}

std::size_t piecesIn(const std::vector<int32_t>& corners) {
    std::size_t pieces = 0;
    bool open = false;
    for (const int32_t corner : corners) {
        if (corner >= 0 && !open) ++pieces;
        open = corner >= 0;
    }
    return pieces;
}

/// Of colours and the like: one for each corner, or for each piece. How many numbers were bad, or missing.
std::size_t mendNumbers(std::vector<int32_t>& numbers, const std::vector<int32_t>& corners, bool eachCorner,
                        int count) {
    std::size_t bad = 0;
    const std::size_t wanted = eachCorner ? corners.size() : piecesIn(corners);
    if (numbers.size() < wanted) {
        bad += wanted - numbers.size();
        for (std::size_t i = numbers.size(); i < wanted; ++i)
            numbers.push_back(eachCorner && corners[i] == -1 ? -1 : 0);
    }
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        const bool separates = eachCorner && i < corners.size() && corners[i] == -1;
        if (separates) {
            numbers[i] = -1;
        } else if (numbers[i] < 0 || numbers[i] >= count) {
            ++bad;
            numbers[i] = 0;
        }
    }
    return bad;
}

std::string spoken(std::size_t pieces, std::size_t numbers, const char* what) {
    std::string text;
    if (pieces > 0) text = fmt::format("{} of its {} name vertices that do not exist, and are left out", pieces, what);
    if (numbers > 0)
        text += fmt::format(
            "{}{} numbers of colours, normals or texture coordinates are wrong or missing: the first "
            "is taken",
            text.empty() ? "" : "; ", numbers);
    return text;
}

/// Fills a list, which is not empty, up to what corners ask of it.
template <typename Field>
std::size_t fill(Field& field, std::size_t wanted) {
    const auto have = static_cast<std::size_t>(field.getNum());
    if (have >= wanted) return 0;
    const auto last = field[static_cast<int>(have) - 1];
    field.setNum(static_cast<int>(wanted));
    auto* const values = field.startEditing();
    std::fill(values + have, values + wanted, last);
    field.finishEditing();
    return wanted - have;
}

template <typename Kind>
Kind* nodeOf(const SoSFNode& field) {
    SoNode* const node = field.getValue();
    return node != nullptr && is<Kind>(*node) ? static_cast<Kind*>(node) : nullptr;
}

/// Numbers where there is a list of them, else as many as corners or pieces need.
template <typename Field>
std::size_t mendList(Field& list, SoMFInt32& index, const std::vector<int32_t>& corners, int points, bool eachCorner) {
    if (list.getNum() == 0) return 0;
    if (index.getNum() == 0) return fill(list, eachCorner ? static_cast<std::size_t>(points) : piecesIn(corners));
    std::vector<int32_t> numbers = listOf(index);
    const std::vector<int32_t> before = numbers;
    const std::size_t bad = mendNumbers(numbers, corners, eachCorner, list.getNum());
    if (numbers != before) write(index, numbers);
    return bad;
}

/// Of a shape of Inventor: numbers that it takes from lists without naming them.
struct Needed {
    std::size_t normals = 0, places = 0;
};

std::string mendIndexed(SoIndexedShape& set, const SoCallbackAction& action, const SoVertexProperty* own, int points,
                        int binding, Needed& needed) {
    const int normals =
        own != nullptr && own->normal.getNum() > 0 ? own->normal.getNum() : static_cast<int>(action.getNumNormals());
    const int places =
        own != nullptr && own->texCoord.getNum() > 0 ? own->texCoord.getNum() : action.getNumTextureCoordinates();
    std::vector<int32_t> corners = listOf(set.coordIndex);
    if (points == 0) {
        set.coordIndex.setNum(0);
        return {};
    }
    const std::size_t pieces = collapseBadPieces(corners, points);
    if (pieces > 0) write(set.coordIndex, corners);
    std::size_t bad = 0;
    // Whether it is for corners, faces or strips says a binding: there are enough of them for any.
    const auto mend = [&](SoMFInt32& field, int count, std::size_t& unnamed) {
        std::vector<int32_t> numbers = listOf(field);
        if (numbers.empty() || (numbers.size() == 1 && numbers.front() == -1)) {
            unnamed = std::max(corners.size(), static_cast<std::size_t>(points));
            return;
        }
        const std::vector<int32_t> before = numbers;
        for (int32_t& number : numbers)
            if (number < -1 || number >= std::max(count, 1)) {
                number = 0;
                ++bad;
            }
        for (std::size_t i = numbers.size(); i < corners.size(); ++i) numbers.push_back(corners[i] == -1 ? -1 : 0);
        if (numbers != before) write(field, numbers);
    };
    std::size_t materials = 0;
    mend(set.normalIndex, normals, needed.normals);
    mend(set.textureCoordIndex, places, needed.places);
    mend(set.materialIndex, std::numeric_limits<int>::max(), materials);
    // One for each face, in turn.

    if (binding == SoNormalBinding::PER_FACE || binding == SoNormalBinding::PER_PART) needed.normals = corners.size();
    if (binding == SoNormalBinding::PER_FACE) needed.normals = std::min(needed.normals, piecesIn(corners));
    if (binding == SoNormalBinding::OVERALL) needed.normals = 1;
    return spoken(pieces, bad, "faces or lines");
}

/// Runs of vertices one behind the other.
std::string mendRuns(SoNonIndexedShape& set, int points, int binding, Needed& needed) {
    int start = set.startIndex.getValue();
    std::string wrong;
    const auto leaveOut = [&] { wrong = "what names vertices that do not exist is left out"; };
    if (start < 0 || start > points) {
        leaveOut();
        start = std::clamp(start, 0, points);
        set.startIndex = start;
    }
    needed.normals = needed.places = static_cast<std::size_t>(points);
    std::size_t parts = needed.normals, faces = needed.normals;
    if (is<SoPointSet>(set)) {
        auto& count = static_cast<SoPointSet&>(set).numPoints;
        if (count.getValue() < -1 || count.getValue() > points - start) {
            leaveOut();
            count = points - start;
        }
    } else if (is<SoQuadMesh>(set)) {
        auto& mesh = static_cast<SoQuadMesh&>(set);
        const double row = mesh.verticesPerRow.getValue(), column = mesh.verticesPerColumn.getValue();
        if (row < 1 || column < 1 || row * column > points - start) {
            leaveOut();
            mesh.verticesPerRow = 1;
            mesh.verticesPerColumn = 1;
        }
    } else {
        SoField* const field = set.getField("numVertices");
        if (field == nullptr || !field->isOfType(SoMFInt32::getClassTypeId())) return wrong;
        auto& runs = *static_cast<SoMFInt32*>(field);
        std::vector<int32_t> counts = listOf(runs);
        const int32_t least = is<SoLineSet>(set) ? 2 : 3;  // of fewer Coin reads on without end
        std::int64_t left = points - start;
        std::size_t good = 0;
        for (; good < counts.size(); ++good) {
            const bool rest = counts[good] == -1 && good + 1 == counts.size();
            if (!rest && (counts[good] < least || counts[good] > left)) break;
            if (!rest) left -= counts[good];
        }
        if (good < counts.size()) {
            leaveOut();
            counts.resize(good);
            write(runs, counts);
        }
        parts = counts.size();
        faces = 0;
        for (const int32_t count : counts)
            faces += is<SoFaceSet>(set) ? 1 : static_cast<std::size_t>(count < 0 ? points : count);
    }
    if (binding == SoNormalBinding::PER_PART) needed.normals = is<SoFaceSet>(set) ? faces : parts;
    if (binding == SoNormalBinding::PER_FACE) needed.normals = faces;
    if (binding == SoNormalBinding::OVERALL) needed.normals = 1;
    return wrong;
}

}  // namespace

std::string mendVrmlIndices(SoNode& geometry) {
    if (is<SoVRMLPointSet>(geometry)) {
        auto& points = static_cast<SoVRMLPointSet&>(geometry);
        auto* const coord = nodeOf<SoVRMLCoordinate>(points.coord);
        auto* const color = nodeOf<SoVRMLColor>(points.color);
        if (coord == nullptr || color == nullptr || color->color.getNum() == 0) return {};
        return spoken(0, fill(color->color, static_cast<std::size_t>(coord->point.getNum())), "points");
    }
    if (is<SoVRMLElevationGrid>(geometry)) {
        auto& grid = static_cast<SoVRMLElevationGrid&>(geometry);
        const double x = grid.xDimension.getValue(), z = grid.zDimension.getValue();
        // In one point Coin would compare each face with each.
        if (!(grid.xSpacing.getValue() > 0 && grid.zSpacing.getValue() > 0)) {
            grid.xDimension = 0;
            grid.zDimension = 0;
            return "its spacing is not more than 0, and it is left out";
        }
        if (!(x >= 2 && z >= 2) || x * z > grid.height.getNum()) {
            if (x >= 2 && z >= 2) {
                grid.xDimension = 0;
                grid.zDimension = 0;
                return "it has fewer heights than its dimensions say, and is left out";
            }
            return {};
        }
        const auto count = [&](SbBool each) {
            return static_cast<std::size_t>(each != FALSE ? x * z : (x - 1) * (z - 1));
        };
        std::size_t bad = 0;
        if (auto* color = nodeOf<SoVRMLColor>(grid.color); color != nullptr && color->color.getNum() > 0)
            bad += fill(color->color, count(grid.colorPerVertex.getValue()));
        if (auto* normal = nodeOf<SoVRMLNormal>(grid.normal); normal != nullptr && normal->vector.getNum() > 0)
            bad += fill(normal->vector, count(grid.normalPerVertex.getValue()));
        if (auto* coord = nodeOf<SoVRMLTextureCoordinate>(grid.texCoord); coord != nullptr && coord->point.getNum() > 0)
            bad += fill(coord->point, count(TRUE));
        return spoken(0, bad, "faces");
    }
    if (!is<SoVRMLIndexedShape>(geometry) && !is<SoVRMLIndexedLine>(geometry)) return {};
    const bool faces = is<SoVRMLIndexedShape>(geometry);
    const auto& coordField =
        faces ? static_cast<SoVRMLIndexedShape&>(geometry).coord : static_cast<SoVRMLIndexedLine&>(geometry).coord;
    auto& index = faces ? static_cast<SoVRMLIndexedShape&>(geometry).coordIndex
                        : static_cast<SoVRMLIndexedLine&>(geometry).coordIndex;
    const auto* const coord = nodeOf<SoVRMLCoordinate>(coordField);
    const int points = coord != nullptr ? coord->point.getNum() : 0;
    if (points == 0) {
        if (index.getNum() > 0) index.setNum(0);
        return {};
    }
    std::vector<int32_t> corners = listOf(index);
    const std::size_t pieces = collapseBadPieces(corners, points);
    if (pieces > 0) write(index, corners);
    std::size_t bad = 0;
    if (faces) {
        auto& set = static_cast<SoVRMLIndexedShape&>(geometry);
        if (auto* color = nodeOf<SoVRMLColor>(set.color))
            bad += mendList(color->color, set.colorIndex, corners, points, set.colorPerVertex.getValue() != FALSE);
        if (auto* normal = nodeOf<SoVRMLNormal>(set.normal))
            bad += mendList(normal->vector, set.normalIndex, corners, points, set.normalPerVertex.getValue() != FALSE);
        if (auto* texture = nodeOf<SoVRMLTextureCoordinate>(set.texCoord))
            bad += mendList(texture->point, set.texCoordIndex, corners, points, true);
    } else {
        auto& set = static_cast<SoVRMLIndexedLine&>(geometry);
        if (auto* color = nodeOf<SoVRMLColor>(set.color))
            bad += mendList(color->color, set.colorIndex, corners, points, set.colorPerVertex.getValue() != FALSE);
    }
    return spoken(pieces, bad, faces ? "faces" : "lines");
}

std::string mendIndices(SoNode& shape, const SoCallbackAction& action) {
    if (!is<SoVertexShape>(shape)) return {};
    SoNode* const property = static_cast<SoVertexShape&>(shape).vertexProperty.getValue();
    auto* const own =
        property != nullptr && is<SoVertexProperty>(*property) ? static_cast<SoVertexProperty*>(property) : nullptr;
    const int binding = own != nullptr && own->normal.getNum() > 0 ? own->normalBinding.getValue()
                                                                   : static_cast<int>(action.getNormalBinding());
    const int points = own != nullptr && own->vertex.getNum() > 0 ? own->vertex.getNum() : action.getNumCoordinates();
    Needed needed;
    std::string wrong = is<SoIndexedShape>(shape)
                            ? mendIndexed(static_cast<SoIndexedShape&>(shape), action, own, points, binding, needed)
                        : is<SoNonIndexedShape>(shape)
                            ? mendRuns(static_cast<SoNonIndexedShape&>(shape), points, binding, needed)
                            : std::string();
    // What is not enough for each corner or face is one for all.
    SoState& state = *action.getState();
    const auto enough = [](int have, std::size_t wanted) {
        return have == 0 || static_cast<std::size_t>(have) >= wanted;
    };
    const int normals = static_cast<int>(action.getNumNormals());
    if (!enough(normals, needed.normals) && (own == nullptr || own->normal.getNum() == 0))
        SoNormalBindingElement::set(&state, &shape, SoNormalBindingElement::OVERALL);
    if (!enough(action.getNumTextureCoordinates(), needed.places) && (own == nullptr || own->texCoord.getNum() == 0))
        SoTextureCoordinateElement::setDefault(&state, &shape);
    if (own != nullptr) {
        if (!enough(own->normal.getNum(), needed.normals)) fill(own->normal, needed.normals);
        if (!enough(own->texCoord.getNum(), needed.places)) fill(own->texCoord, needed.places);
    }
    return wrong;
}

}  // namespace tessera
