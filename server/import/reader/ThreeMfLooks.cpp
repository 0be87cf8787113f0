#include "server/import/reader/ThreeMfLooks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>

namespace tessera {
namespace {

using PropertyKind = ThreeMfProperties::Kind;
using Channels = std::array<float, 4>;

/// Materials of one object; beyond, all of it has colours of corners.
constexpr std::size_t kMostBases = 64;
constexpr std::uint32_t kOpaque = 0xff;

Channels channelsOf(std::uint32_t color) {
    Channels channels;
    for (std::size_t i = 0; i < 4; ++i) channels[i] = static_cast<float>(color >> (24 - 8 * i) & 0xff) / 255;
    return channels;
}

std::uint32_t colorOf(const Channels& channels) {
    std::uint32_t color = 0;
    for (const float channel : channels)
        color = color << 8 | static_cast<std::uint32_t>(std::lround(255 * std::clamp(channel, 0.0f, 1.0f)));
    return color;
}

}  // namespace

ThreeMfLooks::Value ThreeMfLooks::valueOf(std::uint32_t pid, std::uint32_t index, Resolved& last) {
    Value value;
    if (pid == kNoNumber) return value;
    if (last.pid != pid) {
        const auto found = model_.properties.find(pid);
        last = {pid, found == model_.properties.end() ? nullptr : &found->second};
    }
    if (index == kNoNumber) index = 0;
    const ThreeMfProperties* const properties = last.properties;
    const auto isIn = [&](std::size_t count) {
        if (index < count) return true;
        remark_("properties that do not exist: their triangles are plain", std::to_string(index), false);
        return false;
    };
    if (properties == nullptr) {
        remark_("properties that do not exist: their triangles are plain", std::to_string(pid), false);
        return value;
    }
    switch (properties->kind) {
        case PropertyKind::kBase:
        case PropertyKind::kColors:
            if (!isIn(properties->colors.size())) return value;
            value.color = properties->colors[index];
            if (properties->kind == PropertyKind::kBase) {
                value.base = pid;
                value.index = index;
            }
            break;
        case PropertyKind::kTexture: {
            if (!isIn(properties->texcoords.size() / 2)) return value;
            value.texture = properties->of;
            const float u = properties->texcoords[2 * std::size_t{index}],
                        v = properties->texcoords[2 * std::size_t{index} + 1];
            constexpr float kFarthest = 1e6f;
            value.u = std::abs(u) < kFarthest ? u : 0;
            value.v = 1 - (std::abs(v) < kFarthest ? v : 0);
            break;
        }
        case PropertyKind::kComposite:
            if (!isIn(properties->layers.empty() ? 0 : properties->shares.size() / properties->layers.size()))
                return value;
            value = mixedOf(pid, *properties, index);
            break;
        case PropertyKind::kLayers:
            if (!isIn(properties->layers.empty() ? 0 : properties->indices.size() / properties->layers.size()))
                return value;
            value = mixedOf(pid, *properties, index);
            break;
    }
    value.isSaid = true;
    return value;
}

ThreeMfLooks::Value ThreeMfLooks::mixedOf(std::uint32_t pid, const ThreeMfProperties& properties, std::uint32_t index) {
    const auto mix = [&] {
        return properties.kind == PropertyKind::kComposite ? mixtureOf(properties, index) : layersOf(properties, index);
    };
    // Of a few it is mixed sooner than it is found.
    constexpr std::size_t kMany = 8;
    if (properties.layers.size() <= kMany) return mix();
    const std::uint64_t key = std::uint64_t{pid} << 32 | index;
    if (const auto known = mixed_.find(key); known != mixed_.end()) return known->second;
    return mixed_.emplace(key, mix()).first->second;
}

ThreeMfLooks::Value ThreeMfLooks::mixtureOf(const ThreeMfProperties& properties, std::uint32_t index) const {
    const auto base = model_.properties.find(properties.of);
    Channels sum = {0, 0, 0, 0};
    float shares = 0;
    for (std::size_t i = 0; i < properties.layers.size(); ++i) {
        const float share = properties.shares[properties.layers.size() * index + i];
        if (base == model_.properties.end() || properties.layers[i] >= base->second.colors.size()) continue;
        const Channels channels = channelsOf(base->second.colors[properties.layers[i]]);
        for (std::size_t c = 0; c < 4; ++c) sum[c] += share * channels[c];
        shares += share;
    }
    Value value;
    if (!(shares > 0)) {
        remark_("mixtures of nothing are white", std::to_string(index), false);
        return value;
    }
    for (float& channel : sum) channel /= shares;
    value.color = colorOf(sum);
    return value;
}

ThreeMfLooks::Value ThreeMfLooks::layersOf(const ThreeMfProperties& properties, std::uint32_t index) {
    Value value;
    const std::size_t count = properties.layers.size();
    for (std::size_t layer = 0; layer < count; ++layer) {
        const std::uint32_t pid = properties.layers[layer];
        const auto found = model_.properties.find(pid);
        if (found != model_.properties.end() && found->second.kind == PropertyKind::kLayers) {
            remark_("layers of layers are left out", std::to_string(pid), false);
            continue;
        }
        Resolved last;
        const Value above = valueOf(pid, properties.indices[count * index + layer], last);
        if (above.isSaid) value = value.isSaid ? over(value, above, properties.multiplies[layer]) : above;
    }
    return value;
}

ThreeMfLooks::Value ThreeMfLooks::over(const Value& below, const Value& above, bool multiplies) const {
    if (!multiplies && (above.texture != kNoNumber || (above.color & 0xff) == kOpaque)) return above;
    if (below.texture != kNoNumber && above.texture != kNoNumber)
        remark_("several pictures on a triangle: the uppermost is shown", std::to_string(above.texture), false);
    if (!multiplies && below.texture != kNoNumber)
        remark_("translucent colours over pictures are mixed with white", std::to_string(below.texture), false);
    Value value = above.texture != kNoNumber ? above : below;
    const Channels under = channelsOf(below.color), top = channelsOf(above.color);
    Channels mixed;
    for (std::size_t c = 0; c < 4; ++c) {
        if (multiplies)
            mixed[c] = under[c] * top[c];
        else
            mixed[c] = c == 3 ? 1 - (1 - under[3]) * (1 - top[3]) : top[3] * top[c] + (1 - top[3]) * under[c];
    }
    value.color = colorOf(mixed);
    value.base = kNoNumber;
    value.isSaid = true;
    return value;
}

PrintedMesh ThreeMfLooks::meshOf(ThreeMfObject& object, std::vector<ThreeMfLook>& looks) {
    using LookKind = ThreeMfLook::Kind;
    PrintedMesh mesh;
    mesh.positions = std::move(object.positions);
    mesh.indices = std::move(object.indices);
    const bool hasTwoSides = !object.type.empty() && object.type != "model" && object.type != "solidsupport";
    const std::size_t triangles = mesh.indices.size() / 3;
    std::vector<ThreeMfCorners> corners = std::move(object.looks);
    corners.resize(corners.empty() ? 0 : triangles);
    Resolved last;
    const auto valueAt = [&](std::size_t triangle, std::size_t corner) {
        const ThreeMfCorners* const own = corners.empty() ? nullptr : &corners[triangle];
        const std::uint32_t pid = own != nullptr && own->pid != kNoNumber ? own->pid : object.corners.pid;
        std::uint32_t index = own != nullptr ? own->index[corner] : kNoNumber;
        if (index == kNoNumber && own != nullptr) index = own->index[0];
        return valueOf(pid, index == kNoNumber ? object.corners.index[0] : index, last);
    };
    const auto lookOf = [&](const Value& value, bool isTranslucent, bool hasBases) {
        ThreeMfLook look{.isTranslucent = isTranslucent, .hasTwoSides = hasTwoSides};
        if (value.texture != kNoNumber) {
            look.kind = LookKind::kPicture;
            look.of = value.texture;
        } else if (value.base != kNoNumber && hasBases) {
            look.kind = LookKind::kBase;
            look.of = value.base;
            look.index = value.index;
        } else if (value.isSaid) {
            look.kind = LookKind::kColors;
        }
        return look;
    };
    const auto isTranslucent = [](std::uint32_t color) { return (color & 0xff) != kOpaque; };
    if (corners.empty()) {
        const Value value = triangles > 0 ? valueAt(0, 0) : Value{};
        ThreeMfLook look = lookOf(value, isTranslucent(value.color), true);
        if (look.kind == LookKind::kColors || look.kind == LookKind::kPicture) {
            look.kind = LookKind::kColor;  // of a picture one pixel is nothing to look at
            look.index = value.color;
        }
        looks.push_back(look);
        return mesh;
    }
    std::set<std::pair<std::uint32_t, std::uint32_t>> bases;
    for (std::size_t t = 0; t < triangles && bases.size() <= kMostBases; ++t)
        if (const Value value = valueAt(t, 0); value.base != kNoNumber) bases.emplace(value.base, value.index);
    const bool hasBases = bases.size() <= kMostBases;
    if (!hasBases) remark_("base materials of objects of more than 64 are colours of vertices", object.name, false);
    std::map<ThreeMfLook, std::uint32_t> numbers;
    mesh.looks.reserve(triangles);
    for (std::size_t t = 0; t < triangles; ++t) {
        std::array<Value, 3> values;
        for (std::size_t c = 0; c < 3; ++c) values[c] = valueAt(t, c);
        const bool translucent = std::ranges::any_of(values, [&](const Value& v) { return isTranslucent(v.color); });
        const ThreeMfLook look = lookOf(values[0], translucent, hasBases);
        const auto [number, isNew] = numbers.try_emplace(look, static_cast<std::uint32_t>(looks.size()));
        if (isNew) looks.push_back(look);
        mesh.looks.push_back(number->second);
        const bool hasColors = look.kind == LookKind::kColors || look.kind == LookKind::kPicture;
        if (hasColors && mesh.colors.empty()) mesh.colors.resize(3 * triangles, 0xffffffff);
        if (look.kind == LookKind::kPicture && mesh.texcoords.empty()) mesh.texcoords.resize(6 * triangles, 0.0f);
        for (std::size_t c = 0; c < 3 && hasColors; ++c) {
            mesh.colors[3 * t + c] = values[c].color;
            if (look.kind != LookKind::kPicture) continue;
            mesh.texcoords[6 * t + 2 * c] = values[c].u;
            mesh.texcoords[6 * t + 2 * c + 1] = values[c].v;
        }
    }
    // All of one colour are a material of that colour.
    if (looks.size() == 1 && looks[0].kind == LookKind::kColors &&
        std::ranges::all_of(mesh.colors, [&](std::uint32_t color) { return color == mesh.colors[0]; })) {
        looks[0].kind = LookKind::kColor;
        looks[0].index = mesh.colors[0];
        mesh.colors.clear();
    }
    const bool isNeeded =
        std::ranges::any_of(looks, [](const ThreeMfLook& look) { return look.kind == LookKind::kColors; });
    if (!isNeeded && std::ranges::all_of(mesh.colors, [](std::uint32_t color) { return color == 0xffffffff; }))
        mesh.colors.clear();
    if (looks.size() == 1 && mesh.colors.empty() && mesh.texcoords.empty()) mesh.looks.clear();
    return mesh;
}

}  // namespace tessera
