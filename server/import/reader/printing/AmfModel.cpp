#include "server/import/reader/printing/AmfModel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/LowerCase.h"

namespace tessera {
namespace {

constexpr std::size_t kLongestAmfText = 4096;

struct AmfUnit {
    std::string_view name;
    double metres;
};
constexpr AmfUnit kAmfUnits[] = {{"micron", 1e-6}, {"micrometer", 1e-6}, {"millimeter", 1e-3}, {"inch", 0.0254},
                                 {"feet", 0.3048}, {"foot", 0.3048},     {"meter", 1}};

std::uint32_t vertexOf(double number) {
    return number >= 0 && number < kNoNumber && number == std::floor(number) ? static_cast<std::uint32_t>(number)
                                                                             : kNoNumber;
}

/// Colours of all are taken from when the first one has its own.
void keepColor(std::vector<std::optional<AmfColor>>& colors, std::size_t before, const std::optional<AmfColor>& color) {
    if (!color && colors.empty()) return;
    colors.resize(before);
    colors.push_back(color);
}

}  // namespace

void AmfParser::remark(const char* what, std::string_view name, bool isMissing) {
    constexpr std::size_t kLongest = 80;
    remark_(what, std::string(name.substr(0, kLongest)), isMissing);
}

bool AmfParser::takes(std::size_t& count, std::size_t most, const char* what) {
    if (count < most) {
        ++count;
        return true;
    }
    stream_.refuse({ErrorCode::kLimit,
                    fmt::format("it has more than {} {}: save it in parts, or with small ones joined", most, what)});
    return false;
}

void AmfParser::begin(std::string_view name, const XmlAttributes& attributes) {
    State next = State::kOther;
    const auto axisOf = [&](std::string_view first) {
        return name.size() == first.size() + 1 && name.starts_with(first) ? name.back() : '\0';
    };
    switch (states_.back()) {
        case State::kCoordinates:
            if (const char axis = axisOf(""); axis >= 'x' && axis <= 'z')
                next = beginNumber(triple_[static_cast<std::size_t>(axis - 'x')]);
            break;
        case State::kTriangle:
            if (const char corner = axisOf("v"); corner >= '1' && corner <= '3')
                next = beginNumber(triple_[static_cast<std::size_t>(corner - '1')]);
            else if (name == "color")
                next = beginColor();
            else if (name == "texmap" || name == "map")
                remark("pictures on triangles are left out", {});
            break;
        case State::kVertices:
            if (name == "vertex") {
                triple_.fill(std::numeric_limits<double>::quiet_NaN());
                color_.reset();
                next = State::kVertex;
            } else if (name == "edge") {
                remark("edges of curved triangles are left out: triangles are flat", {});
            }
            break;
        case State::kVertex:
            if (name == "coordinates")
                next = State::kCoordinates;
            else if (name == "color")
                next = beginColor();
            else if (name == "normal")
                remark("normals of curved triangles are left out: triangles are flat", {});
            break;
        case State::kColor:
            for (std::size_t channel = 0; channel < channels_.size(); ++channel)
                if (name == std::string_view("rgba").substr(channel, 1)) next = beginNumber(channels_[channel]);
            break;
        case State::kInstance:
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const char letter = "xyz"[axis];
                if (axisOf("delta") == letter) next = beginNumber(instance_.delta[axis]);
                if (axisOf("r") == letter) next = beginNumber(instance_.rotation[axis]);
            }
            break;
        case State::kVolume:
            next = beginInVolume(name, attributes);
            break;
        case State::kMesh:
            next = beginInMesh(name, attributes);
            break;
        case State::kFile:
            next = beginFile(name, attributes);
            break;
        case State::kAmf:
            next = beginInAmf(name, attributes);
            break;
        case State::kConstellation:
            if (name == "instance") {
                if (!takes(placed_, limits_.maxPlaces, "instances")) break;
                instance_ = {.object = indexOf(attributes["objectid"])};
                next = State::kInstance;
                break;
            }
            next = beginAnywhere(name, attributes);
            break;
        case State::kObject:
            if (name == "mesh") {
                next = State::kMesh;
                break;
            }
            next = beginAnywhere(name, attributes);
            break;
        case State::kMaterial:
            if (name == "composite") remark("mixtures of materials are left out", material_->name);
            next = beginAnywhere(name, attributes);
            break;
        case State::kNumber:
        case State::kMetadata:
        case State::kOther:
            break;
    }
    states_.push_back(next);
}

void AmfParser::end() {
    const State ended = states_.back();
    states_.pop_back();
    switch (ended) {
        case State::kNumber:
            *number_ = numberOf(letters_);
            break;
        case State::kVertex:
            addVertex();
            break;
        case State::kTriangle:
            addTriangle();
            break;
        case State::kColor:
            endColor();
            break;
        case State::kInstance:
            model_.constellations.back().instances.push_back(instance_);
            break;
        case State::kMetadata:
            endMetadata();
            break;
        default:
            break;
    }
}

void AmfParser::text(std::string_view letters) {
    if (states_.back() != State::kNumber && states_.back() != State::kMetadata) return;
    if (letters_.size() + letters.size() <= kLongestAmfText) letters_ += letters;
}

AmfParser::State AmfParser::beginFile(std::string_view name, const XmlAttributes& attributes) {
    if (lowerCase(name) != "amf") {
        stream_.refuse({ErrorCode::kBadInput, fmt::format("it is no AMF: it begins with the element '{:.40}'", name)});
        return State::kOther;
    }
    if (const std::string_view unit = attributes["unit"]; !unit.empty()) {
        const auto* const known = std::ranges::find(kAmfUnits, lowerCase(withoutBlanks(unit)), &AmfUnit::name);
        if (known != std::end(kAmfUnits))
            model_.unitMetres = known->metres;
        else
            remark("its unit is not one of AMF: millimetres are taken (--scale changes that)", unit);
    }
    return State::kAmf;
}

AmfParser::State AmfParser::beginInAmf(std::string_view name, const XmlAttributes& attributes) {
    if (name == "object" || name == "constellation" || name == "material") {
        if (!takes(resources_, limits_.maxResources, "objects, materials and constellations")) return State::kOther;
        const std::uint32_t id = indexOf(attributes["id"]);
        if (id == kNoNumber)
            remark("objects and materials whose id is no whole number: nothing can name them", attributes["id"]);
        if (name == "object") {
            model_.objects.emplace_back().id = id;
            return State::kObject;
        }
        if (name == "constellation") {
            model_.constellations.emplace_back().id = id;
            return State::kConstellation;
        }
        const auto [made, isNew] = model_.materials.try_emplace(id);
        if (!isNew) remark("two materials of one number: the first of them counts", attributes["id"]);
        material_ = isNew ? &made->second : &ignored_;
        return State::kMaterial;
    }
    if (name == "texture") remark("pictures on triangles are left out", {});
    return beginAnywhere(name, attributes);
}

AmfParser::State AmfParser::beginInMesh(std::string_view name, const XmlAttributes& attributes) {
    if (name == "vertices") return State::kVertices;
    if (name != "volume") return State::kOther;
    if (!takes(resources_, limits_.maxResources, "volumes")) return State::kOther;
    AmfVolume& volume = model_.objects.back().volumes.emplace_back();
    volume.material = indexOf(attributes["materialid"]);
    if (volume.material == kNoNumber && !attributes["materialid"].empty())
        remark("materials that do not exist: their volumes have none", attributes["materialid"]);
    return State::kVolume;
}

AmfParser::State AmfParser::beginInVolume(std::string_view name, const XmlAttributes& attributes) {
    if (name != "triangle") return beginAnywhere(name, attributes);
    triple_.fill(-1);
    color_.reset();
    return State::kTriangle;
}

AmfParser::State AmfParser::beginAnywhere(std::string_view name, const XmlAttributes& attributes) {
    if (name == "color") return beginColor();
    if (name != "metadata") return State::kOther;
    letters_.clear();
    isName_ = lowerCase(attributes["type"]) == "name";
    return State::kMetadata;
}

AmfParser::State AmfParser::beginColor() {
    channels_ = {0, 0, 0, 1};
    return State::kColor;
}

AmfParser::State AmfParser::beginNumber(double& into) {
    letters_.clear();
    number_ = &into;
    return State::kNumber;
}

void AmfParser::endColor() {
    AmfColor color = 0;
    for (double channel : channels_) {
        if (std::isnan(channel)) {
            remark("colours that are formulas are left out", {});
            return;
        }
        channel = std::clamp(channel, 0.0, 1.0);
        color = color << 8 | static_cast<AmfColor>(std::lround(255 * channel));
    }
    switch (states_.back()) {
        case State::kVertex:
        case State::kTriangle:
            color_ = color;
            break;
        case State::kVolume:
            model_.objects.back().volumes.back().color = color;
            break;
        case State::kObject:
            model_.objects.back().color = color;
            break;
        case State::kMaterial:
            material_->color = color;
            break;
        default:
            break;
    }
}

void AmfParser::endMetadata() {
    if (!isName_) return remark("metadata but names is left out", letters_);
    const std::string name(withoutBlanks(letters_));
    switch (states_.back()) {
        case State::kAmf:
            model_.title = name;
            break;
        case State::kObject:
            model_.objects.back().name = name;
            break;
        case State::kVolume:
            model_.objects.back().volumes.back().name = name;
            break;
        case State::kConstellation:
            model_.constellations.back().name = name;
            break;
        case State::kMaterial:
            material_->name = name;
            break;
        default:
            break;
    }
}

void AmfParser::addVertex() {
    AmfObject& object = model_.objects.back();
    std::size_t count = object.positions.size() / 3;
    if (!takes(count, limits_.maxVertices, "vertices in one object")) return;
    keepColor(object.colors, count - 1, color_);
    for (const double number : triple_) object.positions.push_back(static_cast<float>(number));
}

void AmfParser::addTriangle() {
    AmfVolume& volume = model_.objects.back().volumes.back();
    std::size_t count = volume.indices.size() / 3;
    if (!takes(count, limits_.maxTriangles, "triangles in one volume")) return;
    keepColor(volume.colors, count - 1, color_);
    for (const double number : triple_) volume.indices.push_back(vertexOf(number));
}

}  // namespace tessera
