/// DXF → plain scene: entities become lines, faces, points and letters of layers; blocks are made once for each look.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <tuple>

#include "server/import/reader/DxfContent.h"
#include "server/import/reader/PlainScene.h"

namespace tessera {

class DxfReader {
public:
    DxfReader(DxfDocument document, std::size_t fileBytes, const ReadLimits& limits);

    [[nodiscard]] Expected<PlainScene> read();

private:
    /// What an insert gives to a block's entities that say "as the block" or are on layer 0.
    struct Inherited {
        const DxfLayer* layer = nullptr;  ///< null: not in a block
        DxfColor color{7};
    };
    /// Content that is being read, and where its next entity goes.
    struct Reading {
        Inherited inherited;
        DxfContent content;
        bool byLayer = false, byColor = false;
        std::string_view lastLayer = {};  ///< as the file writes it; of the bucket below
        DxfColor lastColor = {};
        DxfBucket* last = nullptr;
    };

    Expected<void> readContent(Reading& to);
    Expected<void> addEntity(const DxfRecord& record, Reading& to);
    [[nodiscard]] const DxfLayer& layerOf(const DxfRecord& record, Reading& to);
    [[nodiscard]] DxfColor colorOf(const DxfRecord& record, const DxfLayer& layer, Reading& to);
    [[nodiscard]] DxfBucket& bucketOf(const DxfRecord& record, Reading& to);

    // DxfEntities.cpp
    /// False: no entity that has a shape of its own.
    bool addShape(const DxfRecord& record, Reading& to);
    void addCurve(const DxfRecord& record, Reading& to);
    void addLightPolyline(const DxfRecord& record, Reading& to);
    void addPolyline(const DxfRecord& record, Reading& to);
    /// A strip of lines and arcs; `bulges`: of the sides from each corner on.
    void addBulged(const DxfRecord& record, std::span<const Vec3d> corners, std::span<const double> bulges, bool closed,
                   Reading& to);
    void addGrid(const DxfRecord& record, const std::vector<Vec3d>& vertices, bool smooth, Reading& to);
    void addMesh(const DxfRecord& record, Reading& to);
    void addHatch(const DxfRecord& record, Reading& to);
    void addSolid(const DxfRecord& record, Reading& to);
    void addPolygons(const DxfRecord& record, const std::vector<Vec3d>& vertices,
                     const std::vector<std::uint32_t>& corners, const std::vector<std::uint32_t>& sizes, Reading& to);
    void addPath(const DxfRecord& record, std::span<const Vec3d> path, bool closed, Reading& to);
    void addLetters(const DxfRecord& record, std::optional<DxfLetters> letters, Reading& to);
    [[nodiscard]] bool isSound(std::span<const Vec3d> path);
    /// An entity that says too little, or what cannot be.
    void addUnsound();
    /// Of its own curves, about as many as they become.
    [[nodiscard]] static std::size_t curvePointsOf(const DxfRecord& record, const DxfChords& chords);
    /// Counts the curves of the entities that follow.
    void lookAhead();
    /// This one follows no longer.
    void pass(const DxfRecord& record);
    /// For the curves of a record. `halfTurns`: of a polyline its arcs, counted as such.
    [[nodiscard]] const DxfChords& chords(const DxfRecord& record, std::optional<std::size_t> halfTurns = {});
    void countCurve(std::size_t points, const DxfChords& chords);
    /// False, and said: curves have so many points already that no further one is worked out.
    bool hasRoomForCurve(const DxfRecord& record, Reading& to);

    // DxfBlocks.cpp
    Expected<void> addInsert(const DxfRecord& record, Reading& to);
    Expected<void> addBlock(const DxfRecord& record, Reading& to);
    Expected<const DxfGuise*> guise(const DxfBlock& block, const Inherited& inherited);
    /// False, and said: there would be too many.
    bool takeRoomFor(std::size_t places, std::size_t nodesOfEach);
    /// The same for what is placed with a block.
    bool takeRoomFor(std::size_t places, const DxfGuise& guise, DxfContent& to);
    /// Makes nodes of all content; `direct`: the layer that gets no node of its own. How many there are.
    std::size_t emit(DxfContent& content, const std::function<proto::scene::Node*()>& make, const DxfLayer* direct);
    std::size_t emit(DxfColor color, DxfBucket& bucket, const std::function<proto::scene::Node*()>& make);
    [[nodiscard]] const std::string& material(DxfColor color, bool surface);

    void setUnit(proto::scene::Node& root);
    void stand(const Box& bounds);
    void leftOut(const std::string& what);
    void writeNotes();

    DxfDocument document_;
    const ReadLimits& limits_;
    PlainScene scene_;
    std::map<std::string, std::size_t> leftOut_;  ///< how many, by what is said of them
    std::size_t unsound_ = 0, curvePoints_ = 0, coarseOfBlocks_ = 0, meshes_ = 0, placedNodes_ = 0, letters_ = 0,
                placedLetters_ = 0;
    std::size_t coarseAhead_ = 0, roughAhead_ = 0;  ///< points of the curves that follow
    std::string firstUnsound_;
    bool areRough_ = false;  ///< chords of curves, from some curve on

    using GuiseKey = std::tuple<const DxfBlock*, const DxfLayer*, DxfColor>;
    std::map<GuiseKey, DxfGuise> guises_;
    std::map<const DxfBlock*, std::pair<bool, bool>> looks_;  ///< byLayer, byColor of blocks that were read
    std::set<const DxfBlock*> open_;
    std::size_t fileBytes_, bytesOfBlocks_ = 0, mostBytesOfBlocks_, mostNodes_, mostCurvePoints_, mostLetters_;
    std::string curvesBeyond_;
    std::map<std::pair<DxfColor, bool>, std::string> materials_;
};

}  // namespace tessera
