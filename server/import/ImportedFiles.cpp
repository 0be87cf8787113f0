#include "server/import/ImportedFiles.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "server/import/AssetFolders.h"

namespace tessera {
namespace {

constexpr std::size_t kMaxFiles = 1000;

Error replaced() {
    return {ErrorCode::kRefused, "was replaced by a link while it was looked for"};
}

}  // namespace

Expected<LoadedFile*> ImportedFiles::open(const std::string& path) {
    const ImportOptions& options = draft_.options();
    const bool isAsset = path.starts_with(kAssetScheme);
    const Expected<std::string> found =
        isAsset ? findAsset(std::string_view(path).substr(kAssetScheme.size()), options.assetFolders) : path;
    if (!found) return failWith(path, found.error());
    const Expected<std::string> canonical = ordinaryFile(*found, options.maxFileBytes);
    if (!canonical) return failWith(path, canonical.error());
    if ((options.resolved || isAsset) && *canonical != *found) return failWith(path, replaced());
    Expected<LoadedFile*> file = load(*canonical, path);
    if (file) asked_.push_back(path);
    return file;
}

Expected<LoadedFile*> ImportedFiles::imported(const LoadedFile& file, const proto::scene::Import& import) {
    const ImportOptions& options = draft_.options();
    const std::string where = placeText(file.label, import.at());
    if (!file.isScene) return fail(ErrorCode::kBadInput, where + ": a model file may not import others");
    const std::string& uri = import.uri();
    const Expected<std::string> found =
        uri.starts_with(kAssetScheme)
            ? findAsset(std::string_view(uri).substr(kAssetScheme.size()), options.assetFolders)
            : findBeside(uri, folderOf(file.path));
    if (!found) return failWith(where, found.error());
    const Expected<std::string> path = ordinaryFile(*found, options.maxFileBytes);
    if (!path) return failWith(where + ": " + readName(uri, ""), path.error());
    if (*path != *found) return failWith(where + ": " + readName(uri, ""), replaced());
    if (std::ranges::find(underWay_, *path) != underWay_.end())
        return fail(ErrorCode::kBadInput,
                    fmt::format("{}: {} imports itself ({} → {})", where, *path, fmt::join(underWay_, " → "), *path));
    if (underWay_.size() >= options.maxImportDepth)
        return fail(ErrorCode::kLimit, fmt::format("{}: scene files import each other deeper than {} levels", where,
                                                   options.maxImportDepth));

    Expected<LoadedFile*> loaded = load(*path, uri);
    if (!loaded) return failWith(where, loaded.error());
    return loaded;
}

Expected<LoadedFile*> ImportedFiles::load(const std::string& canonicalPath, const std::string& label) {
    std::unique_ptr<LoadedFile>& known = files_[canonicalPath];
    if (!known) {
        if (const auto failed = failed_.find(canonicalPath); failed != failed_.end())
            return tl::unexpected(failed->second);
        if (files_.size() > kMaxFiles)
            return fail(ErrorCode::kLimit, fmt::format("{}: the scene imports more than {} files", label, kMaxFiles));
        Expected<std::unique_ptr<LoadedFile>> loaded = loadFile(canonicalPath, label, draft_.options(), draft_.scene());
        if (!loaded) return tl::unexpected(failed_.emplace(canonicalPath, loaded.error()).first->second);
        known = std::move(*loaded);
    }
    return known.get();
}

void ImportedFiles::noteNoPoints() {
    const std::optional<Placing>& placing = draft_.options().placing;
    if (!placing || !placing->pointRadius) return;
    if (std::ranges::any_of(files_, [](const auto& file) { return file.second->hasPoints; })) return;
    for (const std::string& path : asked_) draft_.note(path + ": point radius: the file has no points");
}

}  // namespace tessera
