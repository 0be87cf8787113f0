/// The pictures that a scene names: read, decoded, cut and joined; those that are not there are left out in words.
#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>
#include <vector>

#include "common/base/Nearest.h"
#include "server/import/reader/ImageDecoder.h"
#include "server/import/reader/SceneExpander.h"

namespace tessera {

Expected<DecodedImage> SceneExpander::readPicture(const std::string& uri) {
    const Expected<Bytes> bytes = files_.read(uri);
    Expected<DecodedImage> decoded = bytes ? pictures_.decode(*bytes) : tl::unexpected(bytes.error());
    if (bytes && !decoded) return failWith(fmt::format("'{}'", uri), decoded.error());
    return decoded;
}

void SceneExpander::collectFilms(const proto::scene::SceneFile& file) {
    std::vector<const proto::scene::Node*> open;
    for (const proto::scene::Node& node : file.node()) open.push_back(&node);
    for (const proto::scene::Definition& definition : file.definition())
        for (const proto::scene::Node& node : definition.node()) open.push_back(&node);
    while (!open.empty()) {
        const proto::scene::Node& node = *open.back();
        open.pop_back();
        if (node.has_movie()) films_.insert(node.movie().image());
        for (const proto::scene::Node& child : node.node()) open.push_back(&child);
    }
}

void SceneExpander::forgetLost() {
    const auto names = [&](const auto& part) { return lost_.contains(part.image()); };
    const google::protobuf::Descriptor& type = *proto::scene::Material::descriptor();
    for (proto::scene::Material& material : *scene_.file.mutable_material()) {
        for (int i = 0; i < type.field_count(); ++i)
            if (const google::protobuf::FieldDescriptor& field = *type.field(i);
                !field.is_repeated() && field.cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_STRING &&
                field.name().ends_with("_image") &&
                lost_.contains(material.GetReflection()->GetString(material, &field)))
                material.GetReflection()->ClearField(&material, &field);
        auto& layers = *material.mutable_layer();
        layers.erase(std::remove_if(layers.begin(), layers.end(), names), layers.end());
        auto& uniforms = *material.mutable_uniform();
        uniforms.erase(std::remove_if(uniforms.begin(), uniforms.end(), names), uniforms.end());
    }
}

void SceneExpander::addFault(const proto::scene::Place& at, std::string what) {
    std::string fault = failAt(at, {ErrorCode::kBadInput, std::move(what)}).value().message;
    // What is repeated comes here again.
    if (std::ranges::find(scene_.faults, fault) == scene_.faults.end()) scene_.faults.push_back(std::move(fault));
}

std::string SceneExpander::notAround(const std::string& image) const {
    using ImageMessage = proto::scene::Image;
    const auto found = std::ranges::find(scene_.file.image(), image, &ImageMessage::name);
    if (found == scene_.file.image().end()) return {};
    if (found->shape() == ImageMessage::LINE || found->shape() == ImageMessage::SOLID)
        return "it is neither flat nor a cube";
    const double width = found->width_px(), height = found->height_px();
    if (found->shape() != ImageMessage::FLAT || std::abs(width - 2 * height) <= height / 8) return {};
    return fmt::format("{} × {} pixels are not about twice as wide as high", width, height);
}

void SceneExpander::lose(const proto::scene::Image& image, const proto::scene::Place& at, const std::string& why) {
    addFault(at, fmt::format("the image '{}' cannot be had: {}; what names it is drawn without", image.name(), why));
    if (!films_.contains(image.name())) lost_.insert(image.name());
    proto::scene::Image* const empty = scene_.file.add_image();
    *empty = image;
    empty->clear_uri();
    empty->clear_face();
}

Expected<void> SceneExpander::expandImage(const proto::scene::Image& image, const proto::scene::Place& at) {
    using ImageMessage = proto::scene::Image;
    if (image.uri().empty() && image.face().empty()) {
        if (image.pixels_blob() == 0 && !films_.contains(image.name()))
            lose(image, at, "it names no file");
        else
            *scene_.file.add_image() = image;
        return {};
    }
    if (!image.face().empty() && (!image.uri().empty() || image.face_size() != 6))
        return fail(ErrorCode::kBadInput, fmt::format("an image has a uri or six faces; this one has {} faces{}",
                                                      image.face_size(), image.uri().empty() ? "" : " and a uri"));
    std::vector<std::string> files(image.face().begin(), image.face().end());
    if (files.empty()) files.push_back(image.uri());
    std::string picture;
    for (const std::string& file : files) {
        if (file.empty() || file.front() == '/' || *std::filesystem::path(file).lexically_normal().begin() == "..")
            return fail(ErrorCode::kRefused, fmt::format("'{}' leads out of the file's own folder", file));
        picture += fmt::format("{}'{}'", picture.empty() ? "" : ", ", file);
    }
    const bool cut = image.shape() != ImageMessage::FLAT && image.face().empty();
    if (cut) picture += fmt::format(" as {}", ImageMessage::Shape_Name(image.shape()));
    if (cut && image.shape() == ImageMessage::SOLID) picture += fmt::format(" of {}", image.depth_px());
    const Expected<ImageMessage*> added = pictures_.addImage(image.name(), picture, [&]() -> Expected<DecodedImage> {
        Expected<DecodedImage> first = readPicture(files.front());
        if (!first || (files.size() == 1 && (!cut || first->shape == image.shape()))) return first;
        if (first->shape != ImageMessage::FLAT)
            return fail(ErrorCode::kBadInput,
                        fmt::format("{} is a {} by itself", picture, ImageMessage::Shape_Name(first->shape)));
        return cut ? cutPicture(std::move(*first), image) : joinFaces(std::move(*first), files);
    });
    // What the text may not name is for its author to mend; whatever a picture is costs the picture.
    if (!added && added.error().code != ErrorCode::kRefused) {
        lose(image, at, added.error().message);
        return {};
    }
    if (!added) return tl::unexpected(added.error());
    **added = image;
    (*added)->clear_uri();
    (*added)->clear_face();
    // The file's own, when all are decoded.
    (*added)->clear_shape();
    (*added)->clear_depth_px();
    (*added)->clear_mipmaps();
    (*added)->clear_encoding();
    return {};
}

/// Slices and faces lie as they do in a flat picture, one below the other.
Expected<DecodedImage> SceneExpander::cutPicture(DecodedImage picture, const proto::scene::Image& image) const {
    using ImageMessage = proto::scene::Image;
    const int parts = image.shape() == ImageMessage::CUBE ? 6
                      : image.shape() == ImageMessage::SOLID
                          ? static_cast<int>(std::clamp<std::int64_t>(image.depth_px(), 1, 4096))
                          : 1;
    if (picture.compressed() && parts > 1) return fail(ErrorCode::kBadInput, "a compressed flat image is not cut");
    if (picture.heightPx % parts != 0)
        return fail(ErrorCode::kBadInput, fmt::format("{} × {} pixels are not {} pictures below each other",
                                                      picture.widthPx, picture.heightPx, parts));
    picture.heightPx /= parts;
    picture.shape = image.shape();
    if (image.shape() == ImageMessage::SOLID) picture.depthPx = parts;
    if (image.shape() == ImageMessage::LINE && picture.heightPx != 1)
        return fail(ErrorCode::kBadInput, fmt::format("a LINE is one pixel high, not {}", picture.heightPx));
    if (image.shape() == ImageMessage::CUBE && picture.widthPx != picture.heightPx)
        return fail(ErrorCode::kBadInput,
                    fmt::format("a CUBE is of six squares, not of {} × {} pixels", picture.widthPx, picture.heightPx));
    return picture;
}

Expected<DecodedImage> SceneExpander::joinFaces(DecodedImage cube, const std::vector<std::string>& files) {
    if (cube.widthPx != cube.heightPx)
        return fail(ErrorCode::kBadInput, fmt::format("'{}': a CUBE is of squares, not of {} × {} pixels",
                                                      files.front(), cube.widthPx, cube.heightPx));
    if (cube.mipmaps > 1)
        return fail(ErrorCode::kBadInput, fmt::format("'{}' has mipmaps, and is no face", files.front()));
    for (std::size_t i = 1; i < files.size(); ++i) {
        const Expected<DecodedImage> face = readPicture(files[i]);
        if (!face) return face;
        if (face->widthPx != cube.widthPx || face->heightPx != cube.heightPx || face->encoding != cube.encoding ||
            face->shape != cube.shape || face->mipmaps != 1)
            return fail(ErrorCode::kBadInput,
                        fmt::format("'{}' is not of the size and kind of '{}'", files[i], files.front()));
        cube.rgba.insert(cube.rgba.end(), face->rgba.begin(), face->rgba.end());
    }
    cube.shape = proto::scene::Image::CUBE;
    return cube;
}

}  // namespace tessera
