/// An AMF file as it stands (ISO/ASTM 52915:2020, "Additive Manufacturing File Format" 1.2): objects of volumes,
/// materials, and constellations that place them. Nothing is looked up or placed.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server/import/reader/printing/ThreeMfModel.h"
#include "server/import/reader/printing/XmlNumbers.h"
#include "server/import/reader/printing/XmlStream.h"

namespace tessera {

/// 0xRRGGBBAA, sRGB.
using AmfColor = std::uint32_t;

struct AmfVolume {
    std::string name;
    std::uint32_t material = kNoNumber;
    std::optional<AmfColor> color;
    std::vector<std::uint32_t> indices;           ///< of the object's vertices
    std::vector<std::optional<AmfColor>> colors;  ///< of each triangle, or none has one
};

struct AmfObject {
    std::uint32_t id = kNoNumber;
    std::string name;
    std::optional<AmfColor> color;
    std::vector<float> positions;
    std::vector<std::optional<AmfColor>> colors;  ///< of each vertex, or none has one
    std::vector<AmfVolume> volumes;
};

struct AmfMaterial {
    std::string name;
    std::optional<AmfColor> color;
};

/// parent_T_object = translation · rotation about z · about y · about x; degrees.
struct AmfInstance {
    std::uint32_t object = kNoNumber;  ///< or a constellation
    std::array<double, 3> delta = {0, 0, 0}, rotation = {0, 0, 0};
};

struct AmfConstellation {
    std::uint32_t id = kNoNumber;
    std::string name;
    std::vector<AmfInstance> instances;
};

struct AmfModel {
    double unitMetres = 0.001;
    std::string title;
    std::vector<AmfObject> objects;
    std::vector<AmfConstellation> constellations;
    std::map<std::uint32_t, AmfMaterial> materials;
};

/// Reads a file, piece by piece.
class AmfParser : private XmlReader {
public:
    struct Limits {
        std::size_t maxPlaces = 500'000, maxResources = 1'000'000;
        std::size_t maxVertices = 64'000'000, maxTriangles = 64'000'000;
    };
    AmfParser(AmfModel& model, PrintingRemark remark, const Limits& limits)
        : model_(model), remark_(std::move(remark)), limits_(limits), stream_(*this) {}

    /// False: it is refused.
    bool feed(ByteSpan piece) { return stream_.feed(piece); }
    /// After the last piece: XmlStream's errors, kLimit. What came before is in the model.
    [[nodiscard]] Expected<void> finish() { return stream_.finish(); }

private:
    enum class State : std::uint8_t {
        kFile,
        kAmf,
        kObject,
        kMesh,
        kVertices,
        kVertex,
        kCoordinates,
        kVolume,
        kTriangle,
        kMaterial,
        kConstellation,
        kInstance,
        kColor,
        kNumber,
        kMetadata,
        kOther,
    };
    void begin(std::string_view name, const XmlAttributes& attributes) override;
    void end() override;
    void text(std::string_view letters) override;

    State beginFile(std::string_view name, const XmlAttributes& attributes);
    State beginInAmf(std::string_view name, const XmlAttributes& attributes);
    State beginInMesh(std::string_view name, const XmlAttributes& attributes);
    State beginInVolume(std::string_view name, const XmlAttributes& attributes);
    /// What objects, volumes, materials and others have alike: names and colours.
    State beginAnywhere(std::string_view name, const XmlAttributes& attributes);
    State beginColor();
    State beginNumber(double& into);
    void endColor();
    void endMetadata();
    void addVertex();
    void addTriangle();
    void remark(const char* what, std::string_view name, bool isMissing = false);
    bool takes(std::size_t& count, std::size_t most, const char* what);

    AmfModel& model_;
    PrintingRemark remark_;
    Limits limits_;
    XmlStream stream_;
    std::vector<State> states_ = {State::kFile};
    std::string letters_;
    bool isName_ = false;
    double* number_ = nullptr;
    std::array<double, 3> triple_ = {};    ///< of a vertex or a triangle
    std::array<double, 4> channels_ = {};  ///< of a colour
    std::optional<AmfColor> color_;        ///< of a vertex or a triangle
    AmfMaterial* material_ = nullptr;
    AmfMaterial ignored_;
    AmfInstance instance_;
    std::size_t placed_ = 0, resources_ = 0;
};

}  // namespace tessera
