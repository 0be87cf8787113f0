/// Builds one change list out of checked scene files: creates cores once, places nodes as often as they are used.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "common/change/ChangeList.h"
#include "common/scene/FieldTable.h"
#include "common/scenefile/SavedReader.h"
#include "server/import/Importer.h"
#include "server/import/LoadedFile.h"
#include "server/rules/Fault.h"
#include "server/text/Typesetter.h"

namespace tessera {

/// One import under way. Not thread-safe. After an error it is of no further use. Its parts: SceneAssembly.cpp places
/// nodes, SceneCores.cpp makes cores, SceneNames.cpp resolves names, AnimationCores.cpp those of channels and joints, SavedObjects.cpp takes over what was saved.
class SceneAssembly {
public:
    explicit SceneAssembly(const ImportOptions& options);
    ~SceneAssembly();

    /// Reads the file (and what it imports) and places its content under `parent`.
    [[nodiscard]] Expected<void> add(const std::string& path, ObjectId parent);
    /// All that was added; fails where the whole makes no sense (server/rules), with the place where that was written.
    [[nodiscard]] Expected<ImportedScene> take();

private:
    /// A node of the new scene, as far as names must be found again.
    struct Placed {
        ObjectId id;
        std::string name;
        ObjectId transform;     ///< its core, where that is a Transform
        ObjectId content = {};  ///< the core of what it is besides: its own, or of a node below
        Affine3d parent_T_node = Affine3d::Identity();  ///< of its transform
        bool movesOtherwise = false;                    ///< by another core than a Transform
        bool evenScale = true;  ///< that transform scales all axes alike
        Placed* parent = nullptr;
        std::vector<Placed*> children;

        /// The so-manieth child of a name, or null. Many children are looked up through a table that grows with them: each of
        /// ten thousand repeated nodes may name another one.
        [[nodiscard]] Placed* child(std::string_view name, std::size_t which);

    private:
        std::unordered_map<std::string_view, std::vector<Placed*>> byName_;
        std::size_t entered_ = 0;  ///< children that byName_ knows: their names stay
    };
    /// Where a node is being placed.
    struct Spot {
        ObjectId parent;
        Placed* placed = nullptr;  ///< the parent, as far as this import made it
        Placed* top = nullptr;     ///< names are looked up no further out than this
        std::size_t depth = 0;
        bool camerasEnabled = true;
        std::string material = {};  ///< of geometry that names none: an instance's, for what its definition leaves open
        ObjectId paint = {};        ///< of all geometry, whatever it names: an import's
    };
    /// A name to be looked up once everything has its place.
    struct PendingRef {
        enum class Kind { kMotionTarget, kInterestObject, kInterestAgainst, kCollisionNode, kBeacon, kScope, kManipulatorTarget };
        Kind kind;
        ObjectId core;
        Placed* from;
        Placed* top;
        std::string name;
        std::string where;  ///< file:line:column
        bool free = false;  ///< a collision object with a mass; a manipulator of a light
        ObjectType type = {};  ///< of a light
    };
    /// Channels and joints to be looked up then; of an animation or of a skin.
    struct PendingParts {
        ObjectId core;
        const proto::scene::Animation* animation = nullptr;
        const proto::scene::Skin* skin = nullptr;
        Placed* from;
        Placed* top;
        std::string where;
    };

    /// The Transform that puts a file where it shall stand, but for `Placing::fit`, which takes all of it to be known.
    Transform standOf(const LoadedFile& file, const Placing& placing);
    /// Whether a camera that the file enables is to be so here.
    bool enablesCamera(const LoadedFile& file, const Spot& spot, bool wanted);
    Expected<LoadedFile*> load(const std::string& canonicalPath, const std::string& label);
    /// The file that an `import` names, read.
    Expected<LoadedFile*> importedFile(LoadedFile& file, const proto::scene::Import& import);
    /// How many nodes a file's come to, definitions and imports written out: counted before one of them is made, as they multiply. Never more than maxNodes + 1.
    /// Fails where they are nested too deep; imports that fail count for nothing, as whoever places them says why.
    Expected<std::size_t> countNodes(LoadedFile& file, std::size_t depth);
    Expected<std::size_t> countNodes(LoadedFile& file, const google::protobuf::RepeatedPtrField<proto::scene::Node>& nodes, std::size_t depth);
    Expected<void> placeFile(LoadedFile& file, const Spot& spot);
    /// What the file saved, object by object.
    Expected<void> placeSaved(LoadedFile& file, const Spot& spot);
    /// Of a file that saved nothing: what a newer version wrote in it beside what authors write.
    void keepBeside(const LoadedFile& file);
    void keepLater(LaterParts later);
    Expected<void> placeNode(LoadedFile& file, const proto::scene::Node& node, const Spot& spot);
    Expected<void> placeImport(LoadedFile& file, const proto::scene::Node& node, const Spot& spot);
    Expected<void> placeInstance(LoadedFile& file, const proto::scene::Node& instance, Spot spot);
    /// The core that a node's content needs, or none.
    Expected<ObjectId> contentCore(LoadedFile& file, const proto::scene::Node& node, const Spot& spot);
    /// One of its own for each place: each is bent by itself.
    Expected<ObjectId> deformationCore(LoadedFile& file, const proto::scene::Node& node, const Spot& spot);
    /// Names its file so that it is found from anywhere; what would inline itself has failed already.
    Expected<ObjectId> inlineCore(LoadedFile& file, const proto::scene::Node& node);
    Expected<ObjectId> movieCore(LoadedFile& file, const proto::scene::Movie& movie);
    /// Whether a Movie of the file writes the image of that name.
    [[nodiscard]] static bool isFilm(LoadedFile& file, const std::string& name);
    /// Of a type that authors have no message for, by the table's own words.
    Expected<ObjectId> writtenCore(LoadedFile& file, const proto::scene::Node& node, const Spot& spot);
    Expected<ObjectId> skinCore(LoadedFile& file, const proto::scene::Skin& skin, const Spot& spot);
    Expected<LoadedFile::GeometryCore> geometryCore(LoadedFile& file, const proto::scene::Geometry& geometry,
                                                    const Spot& spot);
    Expected<LoadedFile::GeometryCore> surfaceCore(LoadedFile& file, const proto::scene::SubdivisionSurface& message, const Spot& spot);
    Expected<LoadedFile::GeometryCore> textCore(LoadedFile& file, const proto::scene::Text& message, const Spot& spot);
    Expected<LoadedFile::GeometryCore> particlesCore(LoadedFile& file, const proto::scene::Particles& message, const Spot& spot);
    Expected<LoadedFile::GeometryCore> volumeCore(LoadedFile& file, const proto::scene::Volume& message, const Spot& spot);
    Expected<LoadedFile::GeometryCore> nurbsCore(LoadedFile& file, const proto::scene::NurbsSurface& message, const Spot& spot);
    /// A core whose triangles are derived, with its material, into `core`.
    template <typename Surface>
    Expected<LoadedFile::GeometryCore> derivedCore(LoadedFile& file, LoadedFile::GeometryCore& core, Surface surface, const std::string& material, const Spot& spot);
    Expected<ObjectId> materialCore(LoadedFile& file, const std::string& name);
    /// What a material names besides images: set after it is there.
    Expected<void> materialParts(LoadedFile& file, const proto::scene::Material& message, ObjectId id);
    Expected<ObjectId> imageCore(LoadedFile& file, const std::string& name);
    [[nodiscard]] Error tooManyNodes() const;
    [[nodiscard]] Error tooDeep() const;
    Expected<Placed*> newNode(std::string name, ObjectId core, const Spot& spot);
    Placed* placed(ObjectId id, std::string name, Placed* parent);
    Expected<void> resolvePending(std::size_t from);
    Expected<void> resolve(const PendingRef& ref);
    /// By a name, or null.
    [[nodiscard]] Placed* find(Placed* from, Placed* top, const std::string& name) const;
    [[nodiscard]] const TypeInfo* typeOfCreated(ObjectId id) const;
    Expected<void> resolveParts(LoadedFile& file, const PendingParts& parts);
    Expected<void> resolveJoints(LoadedFile& file, const PendingParts& parts);
    Expected<ObjectId> keyFrames(LoadedFile& file, const proto::scene::Channel& channel, const PendingParts& parts);
    /// What has the field: the transform of a node, its content, or the node; or a material.
    Expected<ObjectId> channelTarget(LoadedFile& file, const proto::scene::Channel& channel, const PendingParts& parts);
    /// Where somebody wrote what `checkRules` may refuse; the first place counts.
    void isWritten(ObjectId id, std::string where) { writtenAt_.try_emplace(id, std::move(where)); }
    [[nodiscard]] tl::unexpected<Error> refusal(const Fault& fault) const;
    /// Of the first enabled camera: where the wall would stand.
    static Expected<void> checkCamera(const Placed& node, const proto::scene::Camera& camera);
    /// Manipulators of what a motion or an animation drives: they wait until that is paused.
    void noteDriven();
    void noteUnfree(const PendingRef& ref, const Placed& body);
    /// Of a node's name that will not be as the file has it.
    void noteControls(const LoadedFile& file, std::string_view name);
    /// Of a radius that somebody asked for, where none of the files has points.
    void noteNoPoints();
    /// Of a number that was out of its bounds: "line:column: what". In a scene it is wrong.
    void noteMended(const LoadedFile& file, const std::string& what);
    /// A file that an Inline or a Movie names: ImportedScene::named.
    void noteNamed(const LoadedFile& file, const std::string& path);
    /// For a person to read, each once.
    void note(std::string text);

    template <typename T>
    ObjectId create(const T& value) {
        return createObject(Object::of(value));
    }
    ObjectId createObject(const Object& object);

    const ImportOptions& options_;
    ChangeListBuilder builder_;
    int materialDepth_ = 0;
    ImportedScene result_;
    std::uint64_t nextId_;
    std::size_t written_ = 0;  ///< nodes that nobody saved
    Typesetter typesetter_;
    std::uint64_t derivedTriangles_ = 0;  ///< derived while this import looked at its surfaces
    std::size_t drawn_ = 0;    ///< places of geometries in model files
    std::map<std::string, std::unique_ptr<LoadedFile>> files_;  ///< by canonical path
    std::map<std::string, Error> failed_;                       ///< so are those that could not be read
    std::vector<std::unique_ptr<Placed>> placed_;
    std::vector<PendingRef> pending_;
    std::vector<PendingParts> pendingParts_;
    std::map<std::uint32_t, Placed*> keys_;   ///< of the file that is being placed
    std::vector<const TypeInfo*> types_;      ///< of what is created, by the place among the placeholders
    std::map<ObjectId, std::string> writtenAt_;
    struct SavedPart {
        const LoadedFile* file;
        std::uint64_t firstId;
        std::vector<SavedPlace> places;
    };
    std::vector<SavedPart> saved_;
    std::map<ObjectId, std::string_view> driven_;  ///< cores, and what drives each
    struct Handle {
        ObjectId moved;     ///< the core that it writes
        std::string where;  ///< file:line:column
    };
    std::vector<Handle> handles_;
    std::set<std::string> noted_;
    std::vector<std::string> added_;      ///< as they were named
    std::vector<std::string> importing_;  ///< files being placed, outermost first
};

}  // namespace tessera
