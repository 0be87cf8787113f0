#include "server/import/SceneDraft.h"

#include <fmt/format.h>

#include <utility>

#include "server/import/AssetFolders.h"
#include "server/rules/NameCheck.h"

namespace tessera {
namespace {

constexpr std::size_t kMaxNotes = 1000;

}  // namespace

ObjectId SceneDraft::createObject(const Object& object) {
    const ObjectId id{nextId_++};
    list_.create(id, typeOf(object));
    setAllFields(list_, id, object);
    types_.resize(id.value - kFirstPlaceholder + 1);
    types_.back() = &object.info();
    if (object.is<Node>())
        ++scene_.nodes;
    else
        ++scene_.cores;
    return id;
}

const TypeInfo* SceneDraft::typeOfCreated(ObjectId id) const {
    const std::uint64_t place = id.value - kFirstPlaceholder;
    const TypeInfo* type = place < types_.size() ? types_[place] : nullptr;
    return type ? type : findType(typeOf<Node>());  // of what was saved only nodes are found
}

void SceneDraft::countDrawable(std::uint64_t triangles) {
    ++scene_.geometries;
    scene_.trianglesStored += triangles;
}

void SceneDraft::countDrawn(std::uint64_t triangles) {
    ++drawn_;
    scene_.triangles += triangles;
}

bool SceneDraft::enablesCamera(const LoadedFile& file, bool camerasEnabled, bool wanted) {
    if (wanted && !camerasEnabled && options_.placing && options_.placing->isInMetres())
        note(fmt::format(
            "{}: its cameras do not take the view, as it stands in metres before the wall; --camera NODE does",
            file.label));
    return wanted && camerasEnabled;
}

Expected<void> SceneDraft::goOn() {
    constexpr std::size_t kStepsAtOnce = 64, kStepsATelling = std::size_t{1} << 14;
    ImportWatch* const watch = options_.watch.get();
    const std::size_t step = steps_++;
    if (watch == nullptr || step % kStepsAtOnce != 0) return {};
    if (std::optional<Error> why = watch->cancelled()) return tl::unexpected(*std::move(why));
    if (step % kStepsATelling == 0) watch->at(ImportWatch::Stage::kBuilding, scene_.nodes, expected_);
    return {};
}

Error SceneDraft::tooManyNodes() const {
    return {ErrorCode::kLimit, fmt::format("the scene has more than {} nodes", options_.maxNodes)};
}

Error SceneDraft::tooDeep() const {
    return {ErrorCode::kLimit, fmt::format("nodes are nested deeper than {} levels", options_.maxDepth)};
}

void SceneDraft::note(std::string text) {
    if (noted_.size() < kMaxNotes && noted_.insert(text).second) scene_.notes.push_back(std::move(text));
}

void SceneDraft::noteMended(const LoadedFile& file, const std::string& what) {
    const std::string text = failInFile(file.label, {ErrorCode::kBadInput, what}).value().message;
    note(text);
    if (file.isScene && scene_.mended.size() < kMaxNotes) scene_.mended.push_back(text);
}

void SceneDraft::noteNamed(const LoadedFile& file, const std::string& path) {
    const std::string folder = folderOf(file.path);
    if (path.starts_with(kAssetScheme)) return;
    if (folder == "/")
        note(file.label +
             ": it lies in the root folder; what it names beside it is read where the server's --allow "
             "says so");
    else if (path.starts_with(folder + "/"))
        scene_.named.push_back(path);
}

void SceneDraft::noteControls(const LoadedFile& file, std::string_view name) {
    if (!isOneLine(name))
        note(file.label + ": names of nodes have line breaks or other control characters: '?' stands for them");
}

std::string SceneDraft::whereWritten(ObjectId id) const {
    const auto written = writtenAt_.find(id);
    return written == writtenAt_.end() ? std::string() : written->second;
}

}  // namespace tessera
