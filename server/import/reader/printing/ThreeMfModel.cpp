#include "server/import/reader/printing/ThreeMfModel.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace tessera {
namespace {

constexpr std::size_t kLongestText = 4096;
constexpr std::uint32_t kWhite = 0xffffffff;

struct Unit {
    std::string_view name;
    double metres;
};
constexpr Unit kUnits[] = {{"micron", 1e-6}, {"millimeter", 1e-3}, {"centimeter", 1e-2},
                           {"inch", 0.0254}, {"foot", 0.3048},     {"meter", 1}};

/// Of the namespaces of extensions the parts by which their versions are known. Of the last three what they add is left
/// out, and the rest is shown as it is.
constexpr std::string_view kExtensions[] = {"/material/", "/production/", "/beamlattice/", "/slice/", "/trianglesets/"};

std::string_view localName(std::string_view name) {
    return name.substr(name.find(':') + 1);
}

}  // namespace

std::uint32_t colorOfHex(std::string_view text, std::uint32_t otherwise) {
    text = withoutBlanks(text);
    if ((text.size() != 7 && text.size() != 9) || text.front() != '#') return otherwise;
    std::uint32_t value = 0;
    const auto [end, error] = std::from_chars(text.data() + 1, text.data() + text.size(), value, 16);
    if (error != std::errc() || end != text.data() + text.size()) return otherwise;
    return text.size() == 9 ? value : value << 8 | 0xff;
}

void ThreeMfParser::remark(const char* what, std::string_view name, bool isMissing) {
    constexpr std::size_t kLongest = 80;
    remark_(what, std::string(name.substr(0, kLongest)), isMissing);
}

bool ThreeMfParser::takes(std::size_t& count, std::size_t most, const char* what) {
    if (count < most) {
        ++count;
        return true;
    }
    stream_.refuse({ErrorCode::kLimit,
                    fmt::format("it has more than {} {}: save it in parts, or with small ones joined", most, what)});
    return false;
}

void ThreeMfParser::begin(std::string_view name, const XmlAttributes& attributes) {
    State next = State::kOther;
    switch (states_.back()) {
        case State::kVertices:
            if (name == "vertex") addVertex(attributes);
            break;
        case State::kTriangles:
            if (name == "triangle") addTriangle(attributes);
            break;
        case State::kFile:
            next = beginModel(name, attributes);
            break;
        case State::kModel:
            next = beginInModel(name, attributes);
            break;
        case State::kResources:
            next = beginResource(name, attributes);
            break;
        case State::kObject:
            next = beginInObject(name);
            break;
        case State::kMesh:
            next = beginInMesh(name);
            break;
        case State::kComponents:
            if (name == "component") addPlace(attributes, object_->components);
            break;
        case State::kBuild:
            if (name == "item") addPlace(attributes, model_.items);
            break;
        case State::kProperties:
            addProperty(name, attributes);
            break;
        case State::kMetadata:
        case State::kOther:
            break;
    }
    states_.push_back(next);
}

void ThreeMfParser::end() {
    if (states_.back() == State::kMetadata && metadata_ == "Title") model_.title = withoutBlanks(letters_);
    states_.pop_back();
}

void ThreeMfParser::text(std::string_view letters) {
    if (states_.back() == State::kMetadata && letters_.size() + letters.size() <= kLongestText) letters_ += letters;
}

ThreeMfParser::State ThreeMfParser::beginModel(std::string_view name, const XmlAttributes& attributes) {
    if (name != "model") {
        stream_.refuse(
            {ErrorCode::kBadInput, fmt::format("it is no model of 3MF: it begins with the element '{:.40}'", name)});
        return State::kOther;
    }
    if (const std::string_view unit = attributes["unit"]; !unit.empty()) {
        const auto* const known = std::ranges::find(kUnits, withoutBlanks(unit), &Unit::name);
        if (known != std::end(kUnits))
            model_.unitMetres = known->metres;
        else
            remark("its unit is not one of 3MF: millimetres are taken (--scale changes that)", unit);
    }
    checkExtensions(attributes["requiredextensions"]);
    return State::kModel;
}

void ThreeMfParser::checkExtensions(std::string_view prefixes) {
    for (std::string_view prefix = nextWord(prefixes); !prefix.empty(); prefix = nextWord(prefixes)) {
        const std::string_view uri = stream_.namespaceOf(prefix);
        if (std::ranges::any_of(kExtensions, [&](std::string_view known) { return uri.find(known) != uri.npos; }))
            continue;
        stream_.refuse({ErrorCode::kUnsupported,
                        fmt::format("it insists on an extension that is not read, '{:.20}' ({:.120}): save it without "
                                    "it, or as core 3MF",
                                    prefix, uri.empty() ? "which it does not declare" : uri)});
    }
}

ThreeMfParser::State ThreeMfParser::beginInModel(std::string_view name, const XmlAttributes& attributes) {
    if (name == "resources") return State::kResources;
    if (name == "build") return State::kBuild;
    if (name != "metadata") return State::kOther;
    metadata_ = localName(attributes["name"]);
    letters_.clear();
    if (metadata_ != "Title") remark("metadata but the title is left out", metadata_);
    return State::kMetadata;
}

ThreeMfParser::State ThreeMfParser::beginResource(std::string_view name, const XmlAttributes& attributes) {
    using Kind = ThreeMfProperties::Kind;
    static constexpr std::pair<std::string_view, Kind> kKinds[] = {{"basematerials", Kind::kBase},
                                                                   {"colorgroup", Kind::kColors},
                                                                   {"texture2dgroup", Kind::kTexture},
                                                                   {"compositematerials", Kind::kComposite},
                                                                   {"multiproperties", Kind::kLayers}};
    if (!takes(resources_, limits_.maxResources, "resources")) return State::kOther;
    if (name == "object") return beginObject(attributes);
    const std::uint32_t id = indexOf(attributes["id"]);
    if (name == "texture2d") {
        addTexture(id, attributes);
        return State::kOther;
    }
    const auto* const known = std::ranges::find(kKinds, name, &std::pair<std::string_view, Kind>::first);
    if (known == std::end(kKinds)) {
        if (name.ends_with("displayproperties"))
            remark("how base materials shine (display properties) is left out", name);
        else if (name == "slicestack")
            remark("slices are left out", attributes["id"]);
        else
            remark("resources of extensions that are not read are left out", name);
        return State::kOther;
    }
    if (!attributes["displaypropertiesid"].empty()) remark("how base materials shine is left out", attributes["id"]);
    const auto [made, isNew] = model_.properties.try_emplace(id);
    if (!isNew || id == kNoNumber) {
        remark("two resources of one number, or one without: the first of them counts", attributes["id"]);
        ignored_ = {};
    }
    properties_ = isNew ? &made->second : &ignored_;
    properties_->kind = known->second;
    properties_->of = indexOf(attributes[known->second == Kind::kTexture ? "texid" : "matid"]);
    std::string_view list = attributes[known->second == Kind::kComposite ? "matindices" : "pids"];
    for (std::string_view word = nextWord(list);
         !word.empty() && takes(propertyCount_, limits_.maxProperties, "colours"); word = nextWord(list))
        properties_->layers.push_back(indexOf(word));
    // Of all layers but the lowest.
    std::string_view methods = attributes["blendmethods"];
    properties_->multiplies.assign(properties_->layers.size(), false);
    for (std::size_t layer = 1; layer < properties_->layers.size(); ++layer)
        properties_->multiplies[layer] = nextWord(methods) == "multiply";
    return State::kProperties;
}

void ThreeMfParser::addTexture(std::uint32_t id, const XmlAttributes& attributes) {
    const auto [made, isNew] = model_.textures.try_emplace(id);
    if (!isNew) return remark("two textures of one number: the first of them counts", attributes["id"]);
    ThreeMfTexture& texture = made->second;
    texture.path = attributes["path"];
    const auto wrapOf = [&](std::string_view style) {
        if (style == "none")
            remark("a picture that ends at its edge (tilestyle none) goes on as it is there", texture.path);
        if (style == "mirror") return ThreeMfTexture::Wrap::kMirror;
        return style == "clamp" || style == "none" ? ThreeMfTexture::Wrap::kClamp : ThreeMfTexture::Wrap::kRepeat;
    };
    texture.wrapU = wrapOf(attributes["tilestyleu"]);
    texture.wrapV = wrapOf(attributes["tilestylev"]);
    texture.isNearest = attributes["filter"] == "nearest";
}

void ThreeMfParser::addProperty(std::string_view name, const XmlAttributes& attributes) {
    using Kind = ThreeMfProperties::Kind;
    const auto colorOf = [&](std::string_view attribute) {
        constexpr std::uint32_t kTransparentBlack = 0;  // which nobody writes
        const std::uint32_t color = colorOfHex(attributes[attribute], kTransparentBlack);
        if (color != kTransparentBlack) return color;
        remark("colours that are none (#RRGGBB or #RRGGBBAA) are white", attributes[attribute]);
        return kWhite;
    };
    const std::size_t each = std::max<std::size_t>(1, properties_->layers.size());
    const auto room = [&](std::size_t count) {
        for (; count > 0; --count)
            if (!takes(propertyCount_, limits_.maxProperties, "colours")) return false;
        return true;
    };
    switch (properties_->kind) {
        case Kind::kBase:
            // A name takes more than a colour.
            if (name != "base" || !room(8)) return;
            properties_->colors.push_back(colorOf("displaycolor"));
            properties_->names.emplace_back(attributes["name"]);
            break;
        case Kind::kColors:
            if (name == "color" && room(1)) properties_->colors.push_back(colorOf("color"));
            break;
        case Kind::kTexture:
            if (name != "tex2coord" || !room(2)) return;
            for (const char* const axis : {"u", "v"})
                properties_->texcoords.push_back(static_cast<float>(numberOf(attributes[axis])));
            break;
        case Kind::kComposite: {
            std::string_view values = attributes["values"];
            if (name != "composite" || !room(each)) return;
            for (std::size_t i = 0; i < each; ++i) {
                const double share = numberOf(nextWord(values));
                properties_->shares.push_back(share > 0 && share < 1e6 ? static_cast<float>(share) : 0.0f);
            }
            break;
        }
        case Kind::kLayers: {
            std::string_view indices = attributes["pindices"];
            if (name != "multi" || !room(each)) return;
            for (std::size_t i = 0; i < each; ++i) {
                const std::uint32_t index = indexOf(nextWord(indices));
                properties_->indices.push_back(index == kNoNumber ? 0 : index);
            }
            break;
        }
    }
}

ThreeMfParser::State ThreeMfParser::beginObject(const XmlAttributes& attributes) {
    const std::uint32_t id = indexOf(attributes["id"]);
    const auto [known, isNew] = model_.objectOf.try_emplace(id, model_.objects.size());
    if (!isNew || id == kNoNumber)
        remark("two objects of one number, or one without: the first of them counts", attributes["id"], true);
    ThreeMfObject& object = model_.objects.emplace_back();
    object.id = id;
    object.name = attributes["name"];
    if (object.name.empty()) object.name = attributes["partnumber"];
    object.name.resize(std::min(object.name.size(), kLongestText));
    object.type = attributes["type"].substr(0, 40);
    object.corners = {indexOf(attributes["pid"]), {indexOf(attributes["pindex"]), kNoNumber, kNoNumber}};
    attributes.each([&](const XmlAttributes::Attribute& attribute) {
        if (localName(attribute.name) == "slicestackid") remark("slices are left out", object.name);
    });
    object_ = &object;
    return State::kObject;
}

ThreeMfParser::State ThreeMfParser::beginInObject(std::string_view name) {
    if (name == "mesh") return State::kMesh;
    if (name == "components") {
        if (object_->corners.pid != kNoNumber)
            remark("a property of an object of components, which has no triangles, says nothing", object_->name);
        return State::kComponents;
    }
    if (name != "metadatagroup") remark("objects that are neither meshes nor components are left out", name, true);
    return State::kOther;
}

ThreeMfParser::State ThreeMfParser::beginInMesh(std::string_view name) {
    if (name == "vertices") return State::kVertices;
    if (name == "triangles") return State::kTriangles;
    if (name == "beamlattice")
        remark("beam lattices are left out", object_->name, true);
    else if (name != "trianglesets")
        remark("parts of meshes of extensions that are not read are left out", name);
    return State::kOther;
}

void ThreeMfParser::addVertex(const XmlAttributes& attributes) {
    std::size_t count = object_->positions.size() / 3;
    if (!takes(count, limits_.maxVertices, "vertices in one object")) return;
    std::array<float, 3> xyz;
    xyz.fill(std::numeric_limits<float>::quiet_NaN());
    attributes.each([&](const XmlAttributes::Attribute& attribute) {
        if (attribute.name.size() == 1 && attribute.name[0] >= 'x' && attribute.name[0] <= 'z')
            xyz[static_cast<std::size_t>(attribute.name[0] - 'x')] = static_cast<float>(numberOf(attribute.value));
    });
    object_->positions.insert(object_->positions.end(), xyz.begin(), xyz.end());
}

void ThreeMfParser::addTriangle(const XmlAttributes& attributes) {
    std::size_t count = object_->indices.size() / 3;
    if (!takes(count, limits_.maxTriangles, "triangles in one object")) return;
    std::array<std::uint32_t, 3> corners = {kNoNumber, kNoNumber, kNoNumber};
    ThreeMfCorners looks;
    attributes.each([&](const XmlAttributes::Attribute& attribute) {
        const bool isNumbered = attribute.name.size() == 2 && attribute.name[1] >= '1' && attribute.name[1] <= '3';
        const auto number = static_cast<std::size_t>(isNumbered ? attribute.name[1] - '1' : 0);
        if (isNumbered && attribute.name[0] == 'v')
            corners[number] = indexOf(attribute.value);
        else if (isNumbered && attribute.name[0] == 'p')
            looks.index[number] = indexOf(attribute.value);
        else if (attribute.name == "pid")
            looks.pid = indexOf(attribute.value);
        else
            remark("what slicers paint on triangles is left out", attribute.name);
    });
    if (looks.pid != kNoNumber || looks.index[0] != kNoNumber || !object_->looks.empty()) {
        object_->looks.resize(count - 1);
        object_->looks.push_back(looks);
    }
    object_->indices.insert(object_->indices.end(), corners.begin(), corners.end());
}

void ThreeMfParser::addPlace(const XmlAttributes& attributes, std::vector<ThreeMfPlace>& to) {
    if (!takes(places_, limits_.maxPlaces, "components and items")) return;
    ThreeMfPlace place{.object = indexOf(attributes["objectid"])};
    attributes.each([&](const XmlAttributes::Attribute& attribute) {
        if (localName(attribute.name) == "path") place.path = pathOf(attribute.value);
        if (attribute.name == "transform") place.transform = transformOf(attribute.value);
        if (attribute.name == "partnumber") {
            place.partNumber = static_cast<std::uint32_t>(model_.partNumbers.size());
            model_.partNumbers.emplace_back(attribute.value.substr(0, kLongestText));
        }
    });
    to.push_back(place);
}

std::uint32_t ThreeMfParser::transformOf(std::string_view text) {
    ThreeMfTransform transform;
    for (double& number : transform) {
        number = numberOf(nextWord(text));
        constexpr double kFarthest = 1e12;
        if (!(std::abs(number) < kFarthest)) return ThreeMfPlace::kUnsound;
    }
    if (!withoutBlanks(text).empty()) return ThreeMfPlace::kUnsound;
    model_.transforms.push_back(transform);
    return static_cast<std::uint32_t>(model_.transforms.size() - 1);
}

std::uint32_t ThreeMfParser::pathOf(std::string_view text) {
    const auto known = paths_.find(text);
    if (known != paths_.end()) return known->second;
    const auto made = static_cast<std::uint32_t>(model_.paths.size());
    model_.paths.emplace_back(text);
    paths_.emplace(text, made);
    return made;
}

}  // namespace tessera
