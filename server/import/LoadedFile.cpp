#include "server/import/LoadedFile.h"

#include "server/import/TableCores.h"

#include <fmt/format.h>
#include <unistd.h>
#include <utility>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <memory>
#include <span>

#include "common/drawable/Drawable.h"
#include "common/scenefile/ArraysFile.h"
#include "common/scenefile/SavedText.h"
#include "server/import/AssetFolders.h"
#include "server/import/ChildProcess.h"
#include "server/import/SceneFileCheck.h"
#include "server/import/TableCores.h"
#include "server/rules/NameCheck.h"

namespace tessera {
namespace {

constexpr std::size_t kMaxNameBytes = 1024;
constexpr int kMaxKeys = 1'000'000;
/// Far beyond any scene, near enough that sums and products of coordinates stay finite in float.
constexpr double kMaxCoordinate = 1e15;
constexpr double kStrongestGravity = 1e6;  // as in the field table

bool within(double value) {
    return std::abs(value) <= kMaxCoordinate;
}  // false for NaN

tl::unexpected<Error> badNumber(std::string_view what) {
    return fail(ErrorCode::kBadInput, fmt::format("{} holds a number that is not finite or beyond 1e15", what));
}

/// The bytes of the file of arrays that a text names. Others that lie there say nothing about it.
std::uintmax_t arraysBeside(const std::string& path) {
    const std::optional<std::string> head = headOfText(path);
    const std::string name = head ? arraysNamedIn(*head) : std::string();
    if (name.empty()) return 0;
    std::error_code unknown;
    const std::filesystem::path beside = std::filesystem::path(path).parent_path() / name;
    const std::uintmax_t size = std::filesystem::is_regular_file(beside, unknown) ? file_size(beside, unknown) : 0;
    return unknown ? 0 : size;
}

constexpr std::size_t kOfMeshes = 6, kOfPacked = 20;

/// Times its bytes that a file may take beyond what each may; 0: what it takes says nothing of them. A small object of
/// a text takes about a kilobyte while it is parsed, sixteen times its letters. A mesh is mapped, read into pools, and
/// three times the arrays that come out, which are no more than twice as many bytes. A drawing's circle becomes chords.
/// Of a 3MF a triangle takes ten bytes, packed; an AMF may be a zip archive, too.
std::size_t memoryPerByte(const std::string& extension) {
    if (extension == "tsct") return 16;
    if (extension == "tsc") return 4;
    if (extension == "dxf") return 10;
    if (extension == "3mf" || extension == "amf") return kOfPacked;
    return extension == "obj" || extension == "stl" || extension == "ply" ? kOfMeshes : 0;
}

/// What these files take to read follows their bytes.
ImportOptions withBoundsOf(const std::string& path, const std::string& extension, ImportOptions options) {
    std::error_code unknown;
    const std::uintmax_t size = std::filesystem::file_size(path, unknown);
    if (unknown || size > options.maxFileBytes) return options;
    const bool text = extension == "tsct";
    const std::uintmax_t beside = text ? std::min<std::uintmax_t>(arraysBeside(path), options.maxFileBytes) : 0;
    const auto bytes = static_cast<std::size_t>(size + beside);
    options.mostCpuTime += std::chrono::seconds(bytes >> 22);
    options.deadline += 4 * std::chrono::seconds(bytes >> 22);
    const std::size_t each = memoryPerByte(extension);
    if (each == 0) return options;
    const std::size_t memory =
        options.maxMemoryBytes + static_cast<std::size_t>(size) * each + static_cast<std::size_t>(beside) * 4;
    // Never so much that the machine itself would be short of it.
    const auto machine =
        static_cast<std::size_t>(::sysconf(_SC_PHYS_PAGES)) * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
    options.maxMemoryBytes = std::max(options.maxMemoryBytes, std::min(memory, machine / 2));
    const std::size_t result = each == kOfMeshes ? 2 * bytes : each == kOfPacked ? 8 * bytes : bytes + bytes / 8;
    options.maxResultBytes = std::max(options.maxResultBytes, result);
    return options;
}

template <typename Item>
std::map<std::string, const Item*> indexByName(const google::protobuf::RepeatedPtrField<Item>& items) {
    std::map<std::string, const Item*> index;
    for (const Item& item : items) index.emplace(item.name(), &item);
    return index;
}

}  // namespace

tl::unexpected<Error> failInFile(const std::string& label, const Error& error) {
    const std::size_t digits = error.message.find_first_not_of("0123456789");
    const bool hasPlace = digits != 0 && digits != std::string::npos && error.message[digits] == ':' &&
                          digits + 1 < error.message.size() &&
                          std::isdigit(static_cast<unsigned char>(error.message[digits + 1])) != 0;
    return fail(error.code, label + (hasPlace ? ":" : ": ") + error.message);
}

std::string placeText(const std::string& label, const proto::scene::Place& at) {
    return at.line() > 0 ? fmt::format("{}:{}:{}", label, at.line(), at.column()) : label;
}

proto::scene::Place placeOf(const proto::scene::Node& node) {
    proto::scene::Place place;
    place.set_line(static_cast<std::uint32_t>(node.at() >> 32));
    place.set_column(static_cast<std::uint32_t>(node.at()));
    return place;
}

Expected<std::unique_ptr<LoadedFile>> loadFile(const std::string& path, const std::string& label,
                                               const ImportOptions& options, ImportedScene& result) {
    const std::string extension = lowerCaseExtension(path);
    const bool isScene = extension == "tsct" || extension == "tsc";
    Expected<ImporterOutput> output = runImporter(path, withBoundsOf(path, extension, options));
    if (!output) return failInFile(label, output.error());
    Expected<proto::scene::SceneFile> content = parseSceneFile(output->scene);
    if (!content) return failWith(label, content.error());
    for (std::string& looked : output->files)
        if (result.files.size() < ImportedScene::kMostFiles) result.files.push_back(std::move(looked));
    auto file = std::make_unique<LoadedFile>();
    file->path = path;
    file->label = label;
    std::error_code unknown;
    if (const std::uintmax_t bytes = std::filesystem::file_size(path, unknown); !unknown) file->bytes = bytes;
    file->isScene = isScene;
    if (options.placing) file->pointRadius = options.placing->pointRadius;
    file->content = std::move(*content);
    file->hasOwnTops = isScene || file->content.by_tessera();
    file->blobs = std::move(output->blobs);
    file->meshes = indexByName(file->content.mesh());
    file->materials = indexByName(file->content.material());
    file->images = indexByName(file->content.image());
    file->definitions = indexByName(file->content.definition());
    for (const std::string& note : output->notes) result.notes.push_back(label + ": " + readName(note, "?"));
    for (const std::string& fault : output->faults) {
        result.faults.push_back(failInFile(label, {ErrorCode::kBadInput, readName(fault, "?")}).value().message);
        result.notes.push_back(result.faults.back());
    }
    if (file->content.node().empty() && file->content.saved().empty()) {
        // What was left away tells why.
        std::string why;
        for (const std::string& note : std::span(output->notes).first(std::min<std::size_t>(output->notes.size(), 3)))
            why += (why.empty() ? ": " : "; ") + readName(note, "?");
        return fail(ErrorCode::kBadInput, label + ": there is nothing in it to show" + why);
    }
    return file;
}

Expected<Blob> LoadedFile::blob(std::uint32_t number) const {
    if (number == 0) return Blob();
    if (number > blobs.size()) return fail(ErrorCode::kBadInput, fmt::format("array {} does not exist", number));
    return blobs[number - 1];
}

Expected<Geometry> LoadedFile::mesh(const std::string& name) {
    if (const auto known = checkedMeshes.find(name); known != checkedMeshes.end()) return known->second;
    const auto found = meshes.find(name);
    if (found == meshes.end())
        return fail(ErrorCode::kBadInput, fmt::format("there is no mesh '{}'", readName(name, "")));
    const proto::scene::Mesh& message = *found->second;
    Geometry geometry;
    const std::pair<Blob*, std::uint32_t> parts[] = {
        {&geometry.positions, message.positions_blob()},   {&geometry.normals, message.normals_blob()},
        {&geometry.colors, message.colors_blob()},         {&geometry.texcoords, message.texcoords_blob()},
        {&geometry.texcoords1, message.texcoords1_blob()}, {&geometry.indices, message.indices_blob()},
        {&geometry.lengths, message.lengths_blob()},       {&geometry.tangents, message.tangents_blob()}};
    for (const auto& [target, number] : parts) {
        Expected<Blob> part = blob(number);
        if (!part) return tl::unexpected(part.error());
        *target = std::move(*part);
    }
    if (!proto::scene::Mesh::Primitive_IsValid(message.primitive()))
        return fail(ErrorCode::kBadInput, fmt::format("mesh '{}': primitive {} is none of its words",
                                                      readName(name, ""), static_cast<int>(message.primitive())));
    geometry.primitive = message.primitive();
    if (geometry.primitive == Geometry::kPoints) {
        geometry.pointRadius = pointRadius.value_or(message.point_radius());
        hasPoints = true;
    }
    if (message.line_width() != 0) geometry.lineWidth = message.line_width();
    if (!(geometry.lineWidth >= Geometry::kThinnestLinePx && geometry.lineWidth <= Geometry::kWidestLinePx))
        return fail(ErrorCode::kBadInput,
                    fmt::format("mesh '{}': line_width is {}: it has to be from {} to {} pixels", readName(name, ""),
                                geometry.lineWidth, Geometry::kThinnestLinePx, Geometry::kWidestLinePx));
    const Drawable drawable = drawableOf(Object::of(geometry));
    Expected<void> checked = drawable.check();
    if (checked) checked = checkMesh(drawable.arrays());  // of a file's mesh that holds nothing, too
    if (!checked) return failWith(fmt::format("mesh '{}'", readName(name, "")), checked.error());
    checkedMeshes.emplace(name, geometry);
    return geometry;
}

bool LoadedFile::isFilm(const std::string& name) {
    if (!films) {
        films.emplace();
        std::vector<const proto::scene::Node*> open;
        for (const proto::scene::Node& node : content.node()) open.push_back(&node);
        for (const proto::scene::Definition& definition : content.definition())
            for (const proto::scene::Node& node : definition.node()) open.push_back(&node);
        while (!open.empty()) {
            const proto::scene::Node& node = *open.back();
            open.pop_back();
            if (node.has_movie()) films->insert(node.movie().image());
            for (const proto::scene::Node& child : node.node()) open.push_back(&child);
        }
    }
    return films->contains(name);
}

Expected<Vec3f> readColor(const proto::scene::Color& message) {
    const Vec3f color(message.r(), message.g(), message.b());
    if (!color.allFinite()) return badNumber("a colour");
    return Vec3f(color.cwiseMax(0.0f).cwiseMin(1e9f));
}

Expected<Quatd> readRotation(const proto::scene::Rotation& message) {
    Quatd rotation = Quatd::Identity();
    if (message.has_quaternion()) {
        const proto::scene::Quaternion& q = message.quaternion();
        rotation = Quatd(q.w(), q.x(), q.y(), q.z());
        if (!(rotation.norm() > 1e-12)) return fail(ErrorCode::kBadInput, "a rotation's quaternion is zero");
    } else if (message.has_axis()) {
        const Vec3d axis(message.axis().x(), message.axis().y(), message.axis().z());
        const double length = axis.norm();
        if (!(length > 1e-12)) return fail(ErrorCode::kBadInput, "a rotation's axis is zero");
        rotation = Quatd(Eigen::AngleAxisd(message.angle_deg() * EIGEN_PI / 180.0, axis / length));
    }
    if (!rotation.coeffs().allFinite()) return badNumber("a rotation");
    return rotation.normalized();
}

Expected<Transform> readTransform(const proto::scene::Transform& message) {
    Transform transform;
    transform.translation = Vec3d(message.translation().x(), message.translation().y(), message.translation().z());
    const Expected<Quatd> rotation = readRotation(message.rotation());
    if (!rotation) return tl::unexpected(rotation.error());
    transform.rotation = *rotation;
    const proto::scene::Factors& s = message.scale();
    if (message.has_uniform_scale())
        transform.scale = Vec3d::Constant(message.uniform_scale());
    else
        transform.scale = Vec3d(s.has_x() ? s.x() : 1.0, s.has_y() ? s.y() : 1.0, s.has_z() ? s.z() : 1.0);
    for (int i = 0; i < 3; ++i)
        if (!within(transform.translation[i]) || !within(transform.scale[i])) return badNumber("a transform");
    return transform;
}

Expected<Environment> readEnvironment(const proto::scene::Environment& message) {
    const Vec3d gravity(message.gravity().x(), message.gravity().y(), message.gravity().z());
    if (!(gravity.cwiseAbs().maxCoeff() <= kStrongestGravity))
        return fail(ErrorCode::kBadInput, fmt::format("gravity's x, y and z must be between {} and {}",
                                                      -kStrongestGravity, kStrongestGravity));
    return readTableObject<Environment>(message);
}

Expected<Blob> readKeys(const proto::scene::Motion& message) {
    if (message.key_size() == 0) return fail(ErrorCode::kBadInput, "a motion has no keys");
    if (message.key_size() > kMaxKeys)
        return fail(ErrorCode::kLimit, fmt::format("a motion has more than {} keys", kMaxKeys));
    std::vector<double> packed;
    packed.reserve(static_cast<std::size_t>(message.key_size()) * 11);
    double before = -1.0;
    for (const proto::scene::Key& key : message.key()) {
        if (!(key.time() > before) || !(key.time() >= 0.0) || !within(key.time()))
            return fail(ErrorCode::kBadInput, "a motion's times do not ascend from 0");
        before = key.time();
        const Expected<Transform> pose = readTransform(key.transform());
        if (!pose) return tl::unexpected(pose.error());
        packed.push_back(key.time());
        packed.insert(packed.end(), pose->translation.begin(), pose->translation.end());
        packed.insert(packed.end(), {pose->rotation.w(), pose->rotation.x(), pose->rotation.y(), pose->rotation.z()});
        packed.insert(packed.end(), pose->scale.begin(), pose->scale.end());
    }
    return Blob::of(std::span<const double>(packed));
}

std::string readName(const std::string& name, std::string_view otherwise) {
    if (name.empty()) return std::string(otherwise);
    std::string clean = name.substr(0, kMaxNameBytes);
    // Cut between characters, not inside one (UTF-8).
    if (clean.size() < name.size())
        while (!clean.empty() && (static_cast<unsigned char>(name[clean.size()]) & 0xc0) == 0x80) clean.pop_back();
    return asOneLine(clean);
}

}  // namespace tessera
