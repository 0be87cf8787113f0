#include "server/import/reader/usd/UsdFiles.h"

#include <fmt/format.h>

#include <vector>

#include "server/import/reader/usd/UsdCrate.h"
#include "server/import/reader/usd/UsdText.h"

namespace tessera {
namespace {

/// "a/./b/../c" is "a/c". Nothing: it leads above its beginning.
std::string withoutDots(std::string_view path) {
    std::vector<std::string_view> parts;
    const bool absolute = path.starts_with('/');
    while (!path.empty()) {
        const std::size_t end = std::min(path.find('/'), path.size());
        const std::string_view part = path.substr(0, end);
        path.remove_prefix(std::min(end + 1, path.size()));
        if (part.empty() || part == ".") continue;
        if (part != "..")
            parts.push_back(part);
        else if (parts.empty())
            return {};
        else
            parts.pop_back();
    }
    return (absolute ? "/" : "") + fmt::format("{}", fmt::join(parts, "/"));
}

std::string folderOf(const std::string& name) {
    const std::size_t slash = name.rfind('/');
    return slash == std::string::npos ? "" : name.substr(0, slash + 1);
}

/// "name.usdz[inside]" in its two parts; of others the second is empty.
std::pair<std::string, std::string> packageAndPart(const std::string& identifier) {
    const std::size_t bracket = identifier.find('[');
    if (bracket == std::string::npos || !identifier.ends_with(']')) return {identifier, {}};
    return {identifier.substr(0, bracket), identifier.substr(bracket + 1, identifier.size() - bracket - 2)};
}

bool isPackage(ByteSpan bytes) {
    return asText(bytes).starts_with("PK\x03\x04") || asText(bytes).starts_with("PK\x05\x06");
}

}  // namespace

std::string UsdFiles::identifierOf(const std::string& asset, const std::string& by) {
    const auto [package, part] = packageAndPart(by);
    const auto [named, namedPart] = packageAndPart(asset);
    if (!part.empty()) {
        // In a package names are relative to the part, and lead nowhere else.
        const std::string inside = withoutDots(folderOf(part) + named);
        return inside.empty() || inside.front() == '/' ? "" : package + "[" + inside + "]";
    }
    std::string file = withoutDots(named.starts_with('/') ? named : folderOf(package) + named);
    return file.empty() || namedPart.empty() ? file : file + "[" + namedPart + "]";
}

Expected<std::shared_ptr<const UsdPackage>> UsdFiles::package(const std::string& name) {
    if (const auto known = packages_.find(name); known != packages_.end()) return known->second;
    Expected<Bytes> bytes = read_(name);
    Expected<std::shared_ptr<const UsdPackage>> opened = nullptr;
    if (!bytes) {
        opened = tl::unexpected(bytes.error());
    } else {
        opened = UsdPackage::open(std::move(*bytes));
        if (!opened) opened = failWith(fmt::format("'{}'", name), opened.error());
    }
    return packages_.emplace(name, std::move(opened)).first->second;
}

Expected<Bytes> UsdFiles::bytes(const std::string& asset, const std::string& by) {
    const std::string identifier = identifierOf(asset, by);
    if (identifier.empty())
        return fail(ErrorCode::kRefused, fmt::format("'{}' leads out of the file's own folder", asset));
    const auto [name, part] = packageAndPart(identifier);
    if (part.empty()) return read_(name);
    const Expected<std::shared_ptr<const UsdPackage>> held = package(name);
    if (!held) return tl::unexpected(held.error());
    const ByteSpan found = (*held)->find(part);
    if (found.empty())
        return (*held)->isPacked(part)
                   ? fail(ErrorCode::kUnsupported, fmt::format("'{}' is compressed, as no file of a usdz may be", part))
                   : fail(ErrorCode::kNotFound, fmt::format("'{}' is not in the package", part));
    return Bytes(found.begin(), found.end());
}

Expected<std::shared_ptr<const UsdLayer>> UsdFiles::parse(const std::string& identifier, ByteSpan bytes) {
    bytesRead_ += bytes.size();
    if (isUsdCrate(bytes)) return readUsdCrate(bytes, identifier, limits_);
    return parseUsdText(asText(bytes), identifier, limits_);
}

Expected<std::shared_ptr<const UsdLayer>> UsdFiles::layer(const std::string& asset, const std::string& by) {
    std::string identifier = identifierOf(asset, by);
    if (identifier.empty())
        return fail(ErrorCode::kRefused, fmt::format("'{}' leads out of the file's own folder", asset));
    if (const auto known = layers_.find(identifier); known != layers_.end()) return known->second;
    if (layers_.size() >= kMostLayers)
        return fail(ErrorCode::kLimit, fmt::format("'{}' is one layer more than {}", asset, kMostLayers));
    const auto load = [&]() -> Expected<std::shared_ptr<const UsdLayer>> {
        const auto [name, part] = packageAndPart(identifier);
        if (part.empty() && !name.ends_with(".usdz")) {
            const Expected<Bytes> read = read_(name);
            if (!read) return tl::unexpected(read.error());
            if (!isPackage(*read)) return parse(identifier, *read);
        }
        const Expected<std::shared_ptr<const UsdPackage>> held = package(name);
        if (!held) return tl::unexpected(held.error());
        const std::string inside = part.empty() ? (*held)->first() : part;
        const ByteSpan found = (*held)->find(inside);
        if (found.empty() && !(*held)->has(inside))
            return fail(ErrorCode::kNotFound, fmt::format("'{}' is not in the package '{}'", inside, name));
        if ((*held)->isPacked(inside))
            return fail(
                ErrorCode::kUnsupported,
                fmt::format("'{}' in the package '{}' is compressed, as no file of a usdz may be", inside, name));
        if (part.empty() && !isUsdCrate(found) && !isUsdText(asText(found)))
            return fail(ErrorCode::kBadInput,
                        fmt::format("the first file in the package, '{}', is no layer of USD, as it has to be: pack it "
                                    "anew with the .usdc or .usda first",
                                    inside));
        return parse(name + "[" + inside + "]", found);
    };
    Expected<std::shared_ptr<const UsdLayer>> loaded = load();
    // Of the file itself everybody knows the name; of others what is wrong has to say where.
    if (!loaded && !by.empty() && loaded.error().message.find(identifier) == std::string::npos)
        loaded = fail(loaded.error().code, identifier + ":" + loaded.error().message);
    return layers_.emplace(identifier, std::move(loaded)).first->second;
}

}  // namespace tessera
