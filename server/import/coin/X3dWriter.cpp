#include <Inventor/fields/SoFields.h>
#include <Inventor/nodes/SoNode.h>
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "server/import/coin/X3dDocument.h"

namespace tessera {
namespace {

using Element = pugi::xml_node;

/// Twice as many brackets come of it.
constexpr std::size_t kMostLevels = kMostBrackets / 4;

/// Nodes of X3D alone that are as good as one of VRML's.
const std::map<std::string_view, const char*> kSame = {{"StaticGroup", "Group"},
                                                       {"CADAssembly", "Group"},
                                                       {"CADLayer", "Group"},
                                                       {"CADFace", "Group"},
                                                       {"Layer", "Group"},
                                                       {"LayerSet", "Group"},
                                                       {"CADPart", "Transform"},
                                                       {"ViewpointGroup", "Group"},
                                                       {"HAnimSegment", "Group"},
                                                       {"PickableGroup", "Group"},
                                                       {"ColorRGBA", "Color"},
                                                       {"UnlitMaterial", "Material"},
                                                       {"PhysicalMaterial", "Material"}};

/// The field of its parent that a node fills where its element does not say.
const char* usualField(std::string_view kind) {
    static const std::map<std::string_view, const char*> kUsual = {{"Appearance", "appearance"},
                                                                   {"Material", "material"},
                                                                   {"UnlitMaterial", "material"},
                                                                   {"PhysicalMaterial", "material"},
                                                                   {"ImageTexture", "texture"},
                                                                   {"PixelTexture", "texture"},
                                                                   {"MovieTexture", "texture"},
                                                                   {"MultiTexture", "texture"},
                                                                   {"TextureTransform", "textureTransform"},
                                                                   {"Coordinate", "coord"},
                                                                   {"CoordinateDouble", "coord"},
                                                                   {"Color", "color"},
                                                                   {"ColorRGBA", "color"},
                                                                   {"Normal", "normal"},
                                                                   {"TextureCoordinate", "texCoord"},
                                                                   {"FontStyle", "fontStyle"},
                                                                   {"AudioClip", "source"},
                                                                   {"Box", "geometry"},
                                                                   {"Sphere", "geometry"},
                                                                   {"Cone", "geometry"},
                                                                   {"Cylinder", "geometry"},
                                                                   {"Text", "geometry"},
                                                                   {"Extrusion", "geometry"},
                                                                   {"ElevationGrid", "geometry"},
                                                                   {"PointSet", "geometry"},
                                                                   {"IndexedFaceSet", "geometry"},
                                                                   {"IndexedLineSet", "geometry"},
                                                                   {"LineSet", "geometry"},
                                                                   {"TriangleSet", "geometry"},
                                                                   {"IndexedTriangleSet", "geometry"},
                                                                   {"TriangleFanSet", "geometry"},
                                                                   {"IndexedTriangleFanSet", "geometry"},
                                                                   {"TriangleStripSet", "geometry"},
                                                                   {"IndexedTriangleStripSet", "geometry"},
                                                                   {"QuadSet", "geometry"},
                                                                   {"IndexedQuadSet", "geometry"},
                                                                   {"Rectangle2D", "geometry"},
                                                                   {"Disk2D", "geometry"},
                                                                   {"Circle2D", "geometry"},
                                                                   {"Arc2D", "geometry"},
                                                                   {"ArcClose2D", "geometry"},
                                                                   {"Polyline2D", "geometry"},
                                                                   {"Polypoint2D", "geometry"},
                                                                   {"TriangleSet2D", "geometry"}};
    const auto found = kUsual.find(kind);
    return found == kUsual.end() ? "children" : found->second;
}

/// A word that VRML takes for a name.
std::string identifier(std::string_view name) {
    std::string word(name.substr(0, 1024));  // as long as a scene's names
    for (char& c : word) {
        const bool bad = static_cast<unsigned char>(c) <= 0x20 || static_cast<unsigned char>(c) >= 0x7f ||
                         std::string_view("\"'#,.[\\]{}+").find(c) != std::string_view::npos;
        if (bad) c = '_';
    }
    if (word.empty() || (word.front() >= '0' && word.front() <= '9') || word.front() == '-') word.insert(0, "_");
    return word;
}

const char* vrmlAccess(std::string_view access) {
    return access == "inputOnly"        ? "eventIn"
           : access == "outputOnly"     ? "eventOut"
           : access == "inputOutput"    ? "exposedField"
           : access == "initializeOnly" ? "field"
                                        : "";
}

std::string vrmlType(const std::string& type) {
    static const std::map<std::string_view, const char*> kOthers = {
        {"SFDouble", "SFFloat"}, {"MFDouble", "MFFloat"}, {"SFVec3d", "SFVec3f"}, {"MFVec3d", "MFVec3f"},
        {"SFVec2d", "SFVec2f"},  {"MFVec2d", "MFVec2f"},  {"MFBool", "MFInt32"}};
    const auto found = kOthers.find(type);
    return found == kOthers.end() ? identifier(type) : found->second;
}

std::string typeOf(const SoField& field) {
    return field.getTypeId().getName().getString();
}

/// One node of each kind that Coin knows, to ask for its fields; null: it does not.
const SoNode* sample(const std::string& kind) {
    static std::map<std::string, SoNode*> kSamples;
    const auto [place, isNew] = kSamples.try_emplace(kind, nullptr);
    if (isNew) {
        const SoType type = SoType::fromName(SbName(("VRML" + kind).c_str()));
        if (type != SoType::badType() && type.isDerivedFrom(SoNode::getClassTypeId()) && type.canCreateInstance()) {
            place->second = static_cast<SoNode*>(type.createInstance());
            place->second->ref();
        }
    }
    return place->second;
}

/// What a surface, a light or a group means without.
bool isSilent(std::string_view field) {
    static const std::set<std::string_view> kWords = {"DEF",
                                                      "USE",
                                                      "containerField",
                                                      "class",
                                                      "id",
                                                      "style",
                                                      "visible",
                                                      "global",
                                                      "bboxDisplay",
                                                      "castShadow",
                                                      "load",
                                                      "metadata",
                                                      "pickable",
                                                      "centerOfRotation",
                                                      "shadows",
                                                      "shadowIntensity",
                                                      "autoRefresh",
                                                      "autoRefreshTimeLimit",
                                                      "description",
                                                      "enabled",
                                                      "bboxCenter",
                                                      "bboxSize",
                                                      "nearDistance",
                                                      "farDistance",
                                                      "viewAll",
                                                      "forceTransitions",
                                                      "creaseAngle",
                                                      "collide",
                                                      "name",
                                                      "reference",
                                                      "index",
                                                      "solid",
                                                      "ccw",
                                                      "pauseTime",
                                                      "resumeTime",
                                                      "attenuation",
                                                      "xmlns"};
    return kWords.contains(field);
}

}  // namespace

void X3dWriter::note(const std::string& text) {
    if (std::ranges::find(result_.notes, text) == result_.notes.end()) result_.notes.push_back(text);
}

void X3dWriter::leaveOut(const std::string& what) {
    ++leftOut_[what.substr(0, 80)];
}

Expected<void> X3dWriter::write(const Element& scene) {
    collect(scene, 0);
    out_ = "#VRML V2.0 utf8\n";
    if (!tooDeep_) statements(scene, 0);
    if (tooDeep_)
        return fail(ErrorCode::kLimit, fmt::format("its nodes are nested deeper than {} levels", kMostLevels));
    routes();
    constexpr std::size_t kMostLines = 10;
    std::size_t line = 0;
    for (const auto& [what, count] : leftOut_) {
        if (++line > kMostLines) {
            note(fmt::format("{} more kinds of X3D's nodes are left out", leftOut_.size() - kMostLines));
            break;
        }
        note(fmt::format("left out: X3D's {}{}", what, count > 1 ? fmt::format(", {} times", count) : ""));
    }
    return {};
}

void X3dWriter::collect(const Element& of, std::size_t depth) {
    if (depth > kMostLevels) {
        tooDeep_ = true;
        return;
    }
    for (const Element& child : of.children()) {
        if (child.type() != pugi::node_element) continue;
        if (const pugi::xml_attribute def = child.attribute("DEF")) named_.emplace(def.value(), child);
        collect(child, depth + 1);
    }
}

void X3dWriter::statements(const Element& of, std::size_t depth) {
    for (const Element& child : of.children())
        if (child.type() == pugi::node_element && statement(child, depth)) out_ += "\n";
}

/// Whether something was written.
bool X3dWriter::statement(const Element& element, std::size_t depth) {
    const std::string kind = element.name();
    if (kind == "ROUTE") {
        const auto end = [&](const char* node, const char* field) {
            return identifier(element.attribute(node).value()) + "." + identifier(element.attribute(field).value());
        };
        routes_.push_back(end("fromNode", "fromField") + " TO " + end("toNode", "toField"));
        return false;
    }
    if (kind == "ProtoDeclare" || kind == "ExternProtoDeclare") {
        proto(element, depth);
        return true;
    }
    if (kind == "IMPORT" || kind == "EXPORT" || kind == "UNIT") {
        leaveOut(kind);
        return false;
    }
    return node(element, depth);
}

bool X3dWriter::node(const Element& element, std::size_t depth) {
    std::string kind = element.name();
    if (kind.starts_with("Metadata") || kind == "IS" || kind == "field" || kind == "WorldInfo") return false;
    if (const pugi::xml_attribute use = element.attribute("USE")) {
        if (!defined_.contains(identifier(use.value()))) {
            leaveOut(fmt::format("USE of '{}', which is not there", use.value()));
            return false;
        }
        out_ += "USE " + identifier(use.value());
        return true;
    }
    if (kind == "ProtoInstance") {
        protoInstance(element, depth);
        return true;
    }
    if (kind == "Script") {
        script(element);
        return true;
    }
    if (madeUp(element, depth)) return true;
    if (kind == "MultiTexture") {
        note("of a MultiTexture the first picture is shown");
        for (const Element& child : element.children())
            if (usualField(child.name()) == std::string_view("texture") && node(child, depth)) return true;
        return false;
    }
    if (const auto same = kSame.find(kind); same != kSame.end()) {
        if (kind.ends_with("Material") || kind == "ColorRGBA")
            note(fmt::format("X3D's {} is shown as {}", kind, same->second));
        kind = same->second;
    }
    if (sample(kind) == nullptr) {
        leaveOut(kind);
        return false;
    }
    return knownNode(element, kind, depth);
}

void X3dWriter::define(const Element& element) {
    if (const pugi::xml_attribute def = element.attribute("DEF")) {
        out_ += "DEF " + identifier(def.value()) + " ";
        defined_.insert(identifier(def.value()));
    }
}

bool X3dWriter::knownNode(const Element& element, const std::string& kind, std::size_t depth) {
    define(element);
    out_ += kind + " {";
    body(element, kind, depth, {});
    out_ += "}";
    return true;
}

void X3dWriter::value(const std::string& type, const std::string& text) {
    if (type == "SFBool") {
        out_ += text == "true" || text == "TRUE" || text == "1" ? "TRUE" : "FALSE";
        return;
    }
    const auto quoted = [](const std::string& letters) {
        std::string all = "\"";
        for (const char c : letters) {
            if (c == '"' || c == '\\') all.push_back('\\');
            all.push_back(c);
        }
        return all + "\"";
    };
    if (type == "SFString") {
        const bool done = text.size() >= 2 && text.front() == '"' && text.back() == '"';
        out_ += done ? text : quoted(text);
    } else if (type == "MFString") {
        const std::size_t begin = text.find_first_not_of(" \t\r\n,");
        out_ += "[" + (begin == text.npos || text[begin] == '"' ? text : quoted(text)) + "]";
    } else if (type.starts_with("MF")) {
        out_ += "[" + text + "]";
    } else {
        out_ += text;
    }
}

void X3dWriter::body(const Element& element, const std::string& kind, std::size_t depth,
                     const std::set<std::string>& passedOver) {
    const SoNode* const known = sample(kind);
    const std::string_view own = element.name();
    for (const pugi::xml_attribute& attribute : element.attributes()) {
        std::string name = attribute.name();
        if (name == "DEF" || name == "containerField" || passedOver.contains(name)) continue;
        if (own == "PhysicalMaterial" && name == "baseColor") name = "diffuseColor";
        if (own == "ColorRGBA" && name == "color") {
            const std::vector<double> all = numbersOf(attribute.value());
            out_ += " color [";
            for (std::size_t i = 0; i + 3 < all.size(); i += 4)
                out_ += fmt::format("{} {} {} ", all[i], all[i + 1], all[i + 2]);
            out_ += "]";
            continue;
        }
        const SoField* const field = known->getField(SbName(name.c_str()));
        if (name == "global") {
            // VRML's lights say it by their kind.
            const bool isGlobal = attribute.value() == std::string_view("true");
            if (isGlobal != (own != "DirectionalLight"))
                note(fmt::format("a {} lights {}, whatever its 'global' says", own,
                                 isGlobal ? "its group alone" : "everything"));
        }
        if (field == nullptr) {
            if (!isSilent(name)) leaveOut(fmt::format("{} of {}", name, own));
            continue;
        }
        const std::string text = attribute.value();
        const std::string type = typeOf(*field);
        if (text.find_first_not_of(" \t\r\n") == text.npos && type.starts_with("SF") && type != "SFString") continue;
        out_ += " " + name + " ";
        value(type, text);
    }
    connections(element);
    children(element, kind, depth);
}

void X3dWriter::children(const Element& element, const std::string& kind, std::size_t depth) {
    const SoNode* const known = sample(kind);
    std::map<std::string, std::vector<Element>> byField;
    std::vector<std::string> order;
    for (const Element& child : element.children()) {
        if (child.type() != pugi::node_element) continue;
        const std::string_view name = child.name();
        if (name == "ROUTE" || name == "ProtoDeclare" || name == "ExternProtoDeclare") {
            if (statement(child, depth)) out_ += " ";
            continue;
        }
        if (name.starts_with("Metadata") || name == "IS") continue;
        std::string field = child.attribute("containerField").value();
        if (field.empty() || known->getField(SbName(field.c_str())) == nullptr) field = usualField(name);
        if (kind == "Switch" && field == "children") field = "choice";
        if (kind == "LOD" && field == "children") field = "level";
        // An instance of a prototype is whatever its parent wants one of.
        if (name == "ProtoInstance" && known->getField(SbName(field.c_str())) == nullptr)
            field = kind == "Shape" ? "geometry" : kind == "Appearance" ? "material" : field;
        const SoField* const into = known->getField(SbName(field.c_str()));
        if (into == nullptr) {
            leaveOut(fmt::format("{} in {}", name, kind));
            continue;
        }
        if (byField[field].empty()) order.push_back(field);
        byField[field].push_back(child);
    }
    for (const std::string& field : order) {
        const bool several = typeOf(*known->getField(SbName(field.c_str()))) == "MFNode";
        const std::size_t before = out_.size();
        out_ += " " + field + (several ? " [" : " ");
        bool any = false;
        for (const Element& child : byField[field]) {
            if (any && !several) {
                leaveOut(fmt::format("a second {} in {}", field, kind));
                break;
            }
            const bool written = node(child, depth + 1);
            if (written) out_ += " ";
            any = any || written;
        }
        if (several)
            out_ += "]";
        else if (!any)
            out_.resize(before);
    }
}

void X3dWriter::connections(const Element& element) {
    for (const Element& is : element.children("IS"))
        for (const Element& connect : is.children("connect"))
            out_ += fmt::format(" {} IS {}", identifier(connect.attribute("nodeField").value()),
                                identifier(connect.attribute("protoField").value()));
}

void X3dWriter::script(const Element& element) {
    define(element);
    out_ += "Script {";
    for (const Element& field : element.children("field")) {
        const std::string access = vrmlAccess(field.attribute("accessType").value());
        // Without values: it is not run. An exposed field of a script VRML 2 does not have.
        if (access == "eventIn" || access == "eventOut")
            out_ += fmt::format(" {} {} {}", access, vrmlType(field.attribute("type").value()),
                                identifier(field.attribute("name").value()));
    }
    out_ += "}";
}

void X3dWriter::interface(const Element& of, bool values, std::size_t depth) {
    for (const Element& field : of.children("field")) {
        const std::string access = field.attribute("accessType").value();
        const std::string type = field.attribute("type").value();
        const std::string word = *vrmlAccess(access) != '\0' ? vrmlAccess(access) : identifier(access);
        out_ += fmt::format(" {} {} {}", word, vrmlType(type), identifier(field.attribute("name").value()));
        if (!values || word == "eventIn" || word == "eventOut") continue;
        out_ += " ";
        if (type == "SFNode" || type == "MFNode") {
            out_ += type == "MFNode" ? "[" : "";
            bool any = false;
            for (const Element& child : field.children())
                if (child.type() == pugi::node_element && (type == "MFNode" || !any))
                    any = node(child, depth + 1) || any;
            out_ += type == "MFNode" ? "]" : any ? "" : "NULL";
            continue;
        }
        std::string text = field.attribute("value").value();
        if (text.find_first_not_of(" \t\r\n") == text.npos && type.starts_with("SF") && type != "SFString") {
            const std::size_t width = type == "SFRotation" || type == "SFColorRGBA" ? 4
                                      : type == "SFVec3f" || type == "SFColor" || type == "SFVec3d" || type == "SFImage"
                                          ? 3
                                      : type == "SFVec2f" || type == "SFVec2d" ? 2
                                                                               : 1;
            for (std::size_t i = 0; i < width; ++i) text += " 0";
        }
        value(vrmlType(type), text);
    }
}

void X3dWriter::proto(const Element& element, std::size_t depth) {
    const std::string name = element.attribute("name").value();
    const bool outside = element.name() == std::string_view("ExternProtoDeclare");
    const Element fields = outside ? element : element.child("ProtoInterface");
    Fields& known = protos_[name];
    for (const Element& field : fields.children("field"))
        known[field.attribute("name").value()] = field.attribute("type").value();
    out_ += (outside ? "EXTERNPROTO " : "PROTO ") + identifier(name) + " [";
    interface(fields, !outside, depth);
    out_ += " ]";
    if (outside) {
        value("MFString", element.attribute("url").value());
        return;
    }
    out_ += " {\n";
    // Names within are the prototype's own.
    const std::set<std::string> defined = std::exchange(defined_, {});
    std::vector<std::string> outer = std::exchange(routes_, {});
    statements(element.child("ProtoBody"), depth + 1);
    routes();
    routes_ = std::move(outer);
    defined_ = defined;
    out_ += "}";
}

void X3dWriter::protoInstance(const Element& element, std::size_t depth) {
    const std::string name = element.attribute("name").value();
    const auto known = protos_.find(name);
    if (known == protos_.end()) {
        leaveOut(fmt::format("ProtoInstance of '{}', which is not declared", name));
        define(element);
        out_ += "Group {}";
        return;
    }
    define(element);
    out_ += identifier(name) + " {";
    for (const Element& held : element.children("fieldValue")) {
        const auto type = known->second.find(held.attribute("name").value());
        if (type == known->second.end()) continue;
        out_ += " " + identifier(type->first) + " ";
        if (type->second == "SFNode" || type->second == "MFNode") {
            out_ += type->second == "MFNode" ? "[" : "";
            bool any = false;
            for (const Element& child : held.children())
                if (child.type() == pugi::node_element) any = node(child, depth + 1) || any;
            out_ += type->second == "MFNode" ? "]" : any ? "" : "NULL";
        } else {
            value(vrmlType(type->second), held.attribute("value").value());
        }
    }
    connections(element);
    out_ += "}";
}

void X3dWriter::routes() {
    for (const std::string& route : routes_) {
        const std::string from = route.substr(0, route.find('.'));
        const std::size_t to = route.find(" TO ") + 4;
        const std::string into = route.substr(to, route.find('.', to) - to);
        if (defined_.contains(from) && defined_.contains(into))
            out_ += "\nROUTE " + route;
        else
            leaveOut("ROUTE between nodes that are not there");
    }
    out_ += "\n";
    routes_.clear();
}

Expected<CoinText> vrmlOfX3dXml(std::string text) {
    pugi::xml_document document;
    const pugi::xml_parse_result parsed = document.load_buffer_inplace(
        text.data(), text.size(), pugi::parse_default | pugi::parse_doctype, pugi::encoding_auto);
    const auto lineOf = [&](std::ptrdiff_t offset) {
        return std::count(text.begin(), text.begin() + std::clamp<std::ptrdiff_t>(offset, 0, std::ssize(text)), '\n') +
               1;
    };
    if (!parsed)
        return fail(ErrorCode::kBadInput,
                    fmt::format("line {}: its XML is no good: {}", lineOf(parsed.offset), parsed.description()));
    for (const Element& node : document.children())
        if (node.type() == pugi::node_doctype &&
            std::string_view(node.value()).find("<!ENTITY") != std::string_view::npos)
            return fail(ErrorCode::kBadInput,
                        "it declares entities of XML, which are not read: write what they stand for");
    const Element scene = document.child("X3D").child("Scene");
    if (!scene) return fail(ErrorCode::kBadInput, "it is XML, but there is no <Scene> in an <X3D>");
    CoinText result;
    if (const Expected<void> written = X3dWriter(result).write(scene); !written) return tl::unexpected(written.error());
    return result;
}

Expected<CoinText> vrmlOfX3dClassic(std::string_view text) {
    pugi::xml_document document;
    if (const Expected<void> parsed = parseX3dClassic(text, document); !parsed) return tl::unexpected(parsed.error());
    CoinText result;
    if (const Expected<void> written = X3dWriter(result).write(document.child("X3D").child("Scene")); !written)
        return tl::unexpected(written.error());
    return result;
}

}  // namespace tessera
