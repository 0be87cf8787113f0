/// Tessera's own scene message to its plain form: shapes become meshes, repeats are written out, materials are
/// inherited, images are decoded, names are checked while line and column are still known.
#pragma once

#include <google/protobuf/text_format.h>

#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/geometry/Primitives.h"
#include "server/import/reader/FolderFiles.h"
#include "server/import/reader/Pictures.h"
#include "server/import/reader/PlainScene.h"

namespace tessera {

class SceneExpander {
public:
    using Places = google::protobuf::TextFormat::ParseInfoTree;

    /// `places` is null for a binary file.
    SceneExpander(const FolderFiles& files, const ReadLimits& limits)
        : files_(files), limits_(limits), pictures_(scene_, limits) {}

    [[nodiscard]] Expected<PlainScene> expand(proto::scene::SceneFile file, const Places* places);

private:
    /// Where a message stands in the file: its field in the message around it.
    struct Where {
        const Places* around = nullptr;
        const google::protobuf::FieldDescriptor* field = nullptr;
        int index = -1;

        [[nodiscard]] proto::scene::Place place() const;
        [[nodiscard]] const Places* inside() const;
    };
    struct Context {
        std::string material;  ///< of shapes that name none
        std::size_t depth = 1;
    };

    /// Where the material and its fields stand in the text, for whoever knows what they may be.
    static void tellPlaces(const Where& where, proto::scene::Material& material);
    Expected<void> expandNode(const proto::scene::Node& node, const Where& where, const Context& context,
                              google::protobuf::RepeatedPtrField<proto::scene::Node>& out);
    Expected<void> expandContent(const proto::scene::Node& node, const Places* places, const std::string& material,
                                 proto::scene::Node& out);
    /// Makes the mesh of a shape unless an equal one is there; returns its name.
    Expected<std::string> shapeMesh(const proto::scene::Node& node);
    Expected<void> expandMesh(const proto::scene::Mesh& mesh);
    Expected<void> expandRuns(const proto::scene::Mesh& mesh, RunKind kind, MeshData data);
    Expected<void> expandImage(const proto::scene::Image& image, const proto::scene::Place& at);
    /// "12:5: message"; the parent puts the file's name in front.
    [[nodiscard]] static tl::unexpected<Error> failAt(const proto::scene::Place& place, const Error& error);
    void addFault(const proto::scene::Place& at, std::string what);
    /// A fault: the image stays, without a picture.
    void lose(const proto::scene::Image& image, const proto::scene::Place& at, const std::string& why);
    /// Why a picture is none that can lie all around; empty: it can.
    [[nodiscard]] std::string notAround(const std::string& image) const;
    [[nodiscard]] Expected<DecodedImage> readPicture(const std::string& uri);
    void collectFilms(const proto::scene::SceneFile& file);
    /// Of materials: what they say of images that cannot be had. Films bring pictures of their own.
    void forgetLost();
    [[nodiscard]] Expected<DecodedImage> cutPicture(DecodedImage picture, const proto::scene::Image& image) const;
    [[nodiscard]] Expected<DecodedImage> joinFaces(DecodedImage cube, const std::vector<std::string>& files);
    /// Its images.
    Expected<void> checkNames(const proto::scene::Material& material) const;
    /// What a newer version added to the authors' messages cannot be expanded: it is named in a note, and left out.
    void nameLater(proto::scene::SceneFile& file);
    template <typename Items>
    Expected<void> collectNames(const Items& items, const Places* places, const char* field,
                                std::set<std::string>& names);
    Expected<void> checkName(const std::set<std::string>& names, const std::string& name, const char* what) const;

    const FolderFiles& files_;
    const ReadLimits& limits_;
    PlainScene scene_;
    Pictures pictures_;
    std::set<std::string> materials_, images_, meshes_, definitions_;
    std::set<std::string> films_;                ///< images that Movies write: what they show is not in a picture
    std::set<std::string> lost_;                 ///< images without a picture
    std::map<std::string, std::string> shapes_;  ///< serialised shape → mesh
    std::size_t nodes_ = 0;
};

}  // namespace tessera
