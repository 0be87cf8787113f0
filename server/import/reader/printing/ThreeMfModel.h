/// A model part of 3MF (.model), as it stands in its package: the core specification 1.3, of the materials extension
/// 1.2 colours, textures, mixtures and layers, of the production extension 1.1 paths. Nothing is looked up or placed.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "server/import/reader/printing/XmlNumbers.h"
#include "server/import/reader/printing/XmlStream.h"

namespace tessera {

/// One kind of colours, pictures or mixtures: what `pid` names, and in it an index.
struct ThreeMfProperties {
    enum class Kind : std::uint8_t { kBase, kColors, kTexture, kComposite, kLayers };
    Kind kind = Kind::kBase;
    std::vector<std::uint32_t> colors;  ///< 0xRRGGBBAA, sRGB: of kBase and kColors
    std::vector<std::string> names;     ///< of kBase
    std::vector<float> texcoords;       ///< of kTexture: u to the right and v up, from the lower left
    std::uint32_t of = kNoNumber;       ///< of kTexture the texture, of kComposite the base materials
    /// Of kComposite base materials and how much of each there is, of kLayers properties from below and whether each
    /// multiplies what is below it, instead of covering it.
    std::vector<std::uint32_t> layers;
    std::vector<bool> multiplies;
    std::vector<float> shares;           ///< of kComposite: of each property as many as `layers`
    std::vector<std::uint32_t> indices;  ///< of kLayers: likewise
};

struct ThreeMfTexture {
    enum class Wrap : std::uint8_t { kRepeat, kMirror, kClamp };
    std::string path;
    Wrap wrapU = Wrap::kRepeat, wrapV = Wrap::kRepeat;
    bool isNearest = false;
};

/// What a triangle's corners have of properties; kNoNumber: as the object says.
struct ThreeMfCorners {
    std::uint32_t pid = kNoNumber;
    std::array<std::uint32_t, 3> index = {kNoNumber, kNoNumber, kNoNumber};
};

/// An object in another one, or in the build.
struct ThreeMfPlace {
    static constexpr std::uint32_t kHere = 0, kUnsound = 0xffffffff;
    std::uint32_t object = kNoNumber;
    std::uint32_t path = kHere;    ///< of ThreeMfModel::paths
    std::uint32_t transform = 0;   ///< of ThreeMfModel::transforms; kUnsound: it is none
    std::uint32_t partNumber = 0;  ///< of ThreeMfModel::partNumbers
};

struct ThreeMfObject {
    std::uint32_t id = 0;
    std::string name, type;
    ThreeMfCorners corners;  ///< of triangles that do not say; the first index holds
    std::vector<float> positions;
    std::vector<std::uint32_t> indices;
    std::vector<ThreeMfCorners> looks;  ///< of each triangle, or none: all are as the object
    std::vector<ThreeMfPlace> components;
};

/// Twelve numbers, row by row: a point is a row before them.
using ThreeMfTransform = std::array<double, 12>;

struct ThreeMfModel {
    double unitMetres = 0.001;
    std::string title;
    std::vector<ThreeMfObject> objects;
    std::map<std::uint32_t, std::size_t> objectOf;  ///< by id
    std::map<std::uint32_t, ThreeMfProperties> properties;
    std::map<std::uint32_t, ThreeMfTexture> textures;
    std::vector<ThreeMfPlace> items;
    std::vector<std::string> paths = {""}, partNumbers = {""};
    std::vector<ThreeMfTransform> transforms = {{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}};
};

/// What is not taken over: its kind, whose it is, and whether triangles are missing then.
using PrintingRemark = std::function<void(const std::string& what, const std::string& name, bool isMissing)>;

/// Reads one part, piece by piece.
class ThreeMfParser : private XmlReader {
public:
    struct Limits {
        std::size_t maxPlaces = 500'000, maxResources = 1'000'000, maxProperties = 16'000'000;
        std::size_t maxVertices = 64'000'000, maxTriangles = 64'000'000;
    };
    ThreeMfParser(ThreeMfModel& model, PrintingRemark remark, const Limits& limits)
        : model_(model), remark_(std::move(remark)), limits_(limits), stream_(*this) {}

    /// False: it is refused.
    bool feed(ByteSpan piece) { return stream_.feed(piece); }
    /// After the last piece: XmlStream's errors; kUnsupported: it insists on an extension that is not read; kLimit.
    /// What came before is in the model.
    [[nodiscard]] Expected<void> finish() { return stream_.finish(); }

private:
    enum class State : std::uint8_t {
        kFile,
        kModel,
        kMetadata,
        kResources,
        kObject,
        kMesh,
        kVertices,
        kTriangles,
        kComponents,
        kBuild,
        kProperties,
        kOther,
    };
    void begin(std::string_view name, const XmlAttributes& attributes) override;
    void end() override;
    void text(std::string_view letters) override;

    State beginModel(std::string_view name, const XmlAttributes& attributes);
    State beginInModel(std::string_view name, const XmlAttributes& attributes);
    State beginResource(std::string_view name, const XmlAttributes& attributes);
    State beginObject(const XmlAttributes& attributes);
    State beginInObject(std::string_view name);
    State beginInMesh(std::string_view name);
    void checkExtensions(std::string_view prefixes);
    void addVertex(const XmlAttributes& attributes);
    void addTriangle(const XmlAttributes& attributes);
    void addPlace(const XmlAttributes& attributes, std::vector<ThreeMfPlace>& to);
    void addProperty(std::string_view name, const XmlAttributes& attributes);
    void addTexture(std::uint32_t id, const XmlAttributes& attributes);
    std::uint32_t transformOf(std::string_view text);
    std::uint32_t pathOf(std::string_view text);
    void remark(const char* what, std::string_view name, bool isMissing = false);
    /// Counts one more; refuses what is more than `most`.
    bool takes(std::size_t& count, std::size_t most, const char* what);

    ThreeMfModel& model_;
    PrintingRemark remark_;
    Limits limits_;
    XmlStream stream_;
    std::vector<State> states_ = {State::kFile};
    ThreeMfObject* object_ = nullptr;
    ThreeMfProperties* properties_ = nullptr;
    ThreeMfProperties ignored_;
    std::string metadata_, letters_;
    std::map<std::string, std::uint32_t, std::less<>> paths_;
    std::size_t places_ = 0, resources_ = 0, propertyCount_ = 0;
};

/// "#RRGGBB" or "#RRGGBBAA" as 0xRRGGBBAA; `otherwise`: it is neither.
[[nodiscard]] std::uint32_t colorOfHex(std::string_view text, std::uint32_t otherwise);

}  // namespace tessera
