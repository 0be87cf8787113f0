#include "server/import/reader/usd/UsdCrate.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>

#include "server/import/reader/usd/UsdCrateBytes.h"
#include "server/import/reader/usd/UsdCrateValues.h"

namespace tessera {
namespace {

constexpr std::string_view kMagic = "PXR-USDC";
constexpr std::size_t kBootstrapBytes = 88;
constexpr unsigned kOldestMinor = 4, kNewestMinor = 13;
/// What values may take beyond a multiple of the file's own size.
constexpr std::uint64_t kFreeBytes = std::uint64_t{256} << 20;
constexpr std::uint64_t kBytesPerByte = 16;
/// Of a prim or a property: three numbers, and its values.
constexpr std::size_t kCrateBytesPerSpec = 16;
/// Of each table, beyond one for each byte of the file.
constexpr std::uint64_t kFreeEntries = 2'000'000;

/// Kinds of specs, as published.
enum SpecKind : std::uint32_t {
    kAttributeSpec = 1,
    kPrimSpec = 6,
    kRootSpec = 7,
    kRelationshipSpec = 8,
    kVariantSpec = 10
};

/// What says nothing about a scene.
bool isForPeople(std::string_view field) {
    static const std::set<std::string_view> kThose = {
        "documentation",  "comment",       "customData", "assetInfo",          "customLayerData", "displayGroup",
        "displayName",    "allowedTokens", "properties", "variantSetChildren", "variantChildren", "connectionChildren",
        "targetChildren", "propertyOrder"};
    return kThose.contains(field);
}

class CrateReader {
public:
    CrateReader(ByteSpan bytes, std::string identifier, const UsdLayerLimits& limits)
        : bytes_(bytes), limits_(limits), layer_(std::make_shared<UsdLayer>()) {
        layer_->identifier = std::move(identifier);
    }

    Expected<std::shared_ptr<const UsdLayer>> read() {
        if (Expected<void> done = readContents(); !done) return tl::unexpected(done.error());
        using Part = Expected<void> (CrateReader::*)();
        for (const Part part : {&CrateReader::readTokens, &CrateReader::readStrings, &CrateReader::readFields,
                                &CrateReader::readFieldSets, &CrateReader::readPaths, &CrateReader::readSpecs})
            if (Expected<void> done = (this->*part)(); !done) return tl::unexpected(done.error());
        UsdCrateValues values(bytes_, minor_, tables_, kFreeBytes + kBytesPerByte * bytes_.size());
        values_ = &values;
        for (const Spec& spec : specs_)
            if (Expected<void> done = addSpec(spec); !done) return tl::unexpected(done.error());
        for (const auto& [prim, names] : orders_) prim->children.order(names);
        return std::shared_ptr<const UsdLayer>(std::move(layer_));
    }

private:
    struct Spec {
        std::uint32_t path = 0, fields = 0, kind = 0;
    };
    struct Field {
        std::uint32_t name = 0;
        UsdCrateRep value;
    };

    static tl::unexpected<Error> cut(std::string_view what) {
        return fail(ErrorCode::kBadInput, fmt::format("it is cut off or damaged: its {} are not whole", what));
    }

    Expected<void> readContents() {
        if (bytes_.size() < kBootstrapBytes) return cut("first bytes");
        const auto version = [&](std::size_t i) { return std::to_integer<unsigned>(bytes_[8 + i]); };
        minor_ = version(1);
        if (version(0) != 0 || minor_ < kOldestMinor || minor_ > kNewestMinor)
            return fail(ErrorCode::kUnsupported,
                        fmt::format("it is a crate of version {}.{}.{}; 0.{} to 0.{} are read here. usdcat of USD's "
                                    "tools writes it anew, also as text (.usda)",
                                    version(0), version(1), version(2), kOldestMinor, kNewestMinor));
        UsdCrateCursor in(bytes_, UsdCrateCursor(bytes_, 16).read<std::uint64_t>());
        const std::uint64_t sections = in.count(32);
        for (std::uint64_t i = 0; i < sections && in.good(); ++i) {
            const ByteSpan name = in.take(16);
            const auto begin = in.read<std::uint64_t>(), size = in.read<std::uint64_t>();
            if (!in.good() || begin > bytes_.size() || size > bytes_.size() - begin) return cut("sections");
            const std::string_view text = asText(name);
            sections_[std::string(text.substr(0, text.find('\0')))] = begin;
        }
        return in.good() ? Expected<void>() : cut("sections");
    }
    Expected<UsdCrateCursor> section(const char* name) const {
        const auto found = sections_.find(name);
        if (found == sections_.end())
            return fail(ErrorCode::kBadInput, fmt::format("it is no sound crate: it has no section {}", name));
        return UsdCrateCursor(bytes_, found->second);
    }
    /// A section that begins with a number of things, of which each takes some part of a byte.
    std::uint64_t count(UsdCrateCursor& in) const {
        const auto said = in.read<std::uint64_t>();
        // Two bits each, pressed together 255 times at most; and no more than are worth it.
        if (said / 4 / 255 > in.left() || said > kFreeEntries + bytes_.size()) in.spoil();
        return in.good() ? said : 0;
    }

    Expected<void> readTokens() {
        Expected<UsdCrateCursor> in = section("TOKENS");
        if (!in) return tl::unexpected(in.error());
        const std::uint64_t said = count(*in);
        const auto size = in->read<std::uint64_t>();
        if (size > kFreeBytes / 2 + kBytesPerByte * bytes_.size()) return cut("words");
        const ByteSpan packed = in->take(in->count(1));
        const std::optional<Bytes> text = in->good() ? unpackUsdBlocks(packed, size) : std::nullopt;
        if (!text || said > text->size()) return cut("words");
        tables_.tokens.reserve(said);
        std::string_view rest = asText(*text);
        while (tables_.tokens.size() < said) {
            const std::size_t end = rest.find('\0');
            if (end == std::string_view::npos) return cut("words");
            tables_.tokens.emplace_back(rest.substr(0, end));
            rest.remove_prefix(end + 1);
        }
        return {};
    }
    Expected<void> readStrings() {
        Expected<UsdCrateCursor> in = section("STRINGS");
        if (!in) return tl::unexpected(in.error());
        tables_.strings.resize(in->count(4));
        for (std::uint32_t& index : tables_.strings) index = in->read<std::uint32_t>();
        return in->good() ? Expected<void>() : cut("strings");
    }
    Expected<void> readFields() {
        Expected<UsdCrateCursor> in = section("FIELDS");
        if (!in) return tl::unexpected(in.error());
        const std::uint64_t said = count(*in);
        if (!in->good()) return cut("fields");
        const auto names = unpackUsdIntegers<std::uint32_t>(*in, said);
        const ByteSpan packed = in->take(in->count(1));
        const std::optional<Bytes> values = names && in->good() ? unpackUsdBlocks(packed, said * 8) : std::nullopt;
        if (said > 0 && (!values || values->size() != said * 8)) return cut("fields");
        fields_.resize(said);
        UsdCrateCursor reps(said > 0 ? ByteSpan(*values) : ByteSpan(), 0);
        for (std::uint64_t i = 0; i < said; ++i) fields_[i] = {(*names)[i], {reps.read<std::uint64_t>()}};
        return {};
    }
    Expected<void> readFieldSets() {
        Expected<UsdCrateCursor> in = section("FIELDSETS");
        if (!in) return tl::unexpected(in.error());
        auto sets = unpackUsdIntegers<std::uint32_t>(*in, count(*in));
        if (!sets || !in->good()) return cut("sets of fields");
        fieldSets_ = std::move(*sets);
        return {};
    }
    Expected<void> readPaths() {
        Expected<UsdCrateCursor> in = section("PATHS");
        if (!in) return tl::unexpected(in.error());
        const std::uint64_t paths = count(*in), said = count(*in);
        const auto indices = unpackUsdIntegers<std::uint32_t>(*in, said);
        const auto names = unpackUsdIntegers<std::int32_t>(*in, said);
        const auto jumps = unpackUsdIntegers<std::int32_t>(*in, said);
        if (!indices || !names || !jumps || !in->good()) return cut("paths");
        tables_.paths.resize(paths);
        // Depth first: where to go on once what is below a path has been read, and whose children those are.
        std::vector<std::pair<std::uint64_t, std::uint32_t>> open;
        std::uint32_t parent = std::numeric_limits<std::uint32_t>::max();
        for (std::uint64_t at = 0, steps = 0; steps < said; ++steps) {
            if (at >= said || (*indices)[at] >= paths) return cut("paths");
            const std::uint32_t index = (*indices)[at];
            UsdCrateTables::Path& path = tables_.paths[index];
            if (path.known) return cut("paths");
            path.known = true;
            path.parent = index;
            if (parent != std::numeric_limits<std::uint32_t>::max()) {
                const std::int64_t name = (*names)[at];
                const auto token = static_cast<std::uint64_t>(name < 0 ? -name : name);
                if (token >= tables_.tokens.size()) return cut("paths");
                path.parent = parent;
                path.name = tables_.tokens[token];
                path.isProperty = name < 0;
                path.depth = tables_.paths[parent].depth + 1;
                if (path.depth > limits_.maxDepth + 8)
                    return fail(ErrorCode::kLimit,
                                fmt::format("prims are nested deeper than {} levels", limits_.maxDepth));
            }
            const std::int32_t jump = (*jumps)[at];
            const bool hasChild = jump > 0 || jump == -1, hasSibling = jump >= 0;
            if (hasChild && hasSibling) open.emplace_back(at + static_cast<std::uint64_t>(jump), parent);
            if (hasChild) parent = index;
            if (!hasChild && !hasSibling) {
                if (open.empty()) break;
                std::tie(at, parent) = open.back();
                open.pop_back();
            } else {
                ++at;
            }
        }
        return {};
    }
    Expected<void> readSpecs() {
        Expected<UsdCrateCursor> in = section("SPECS");
        if (!in) return tl::unexpected(in.error());
        const std::uint64_t said = count(*in);
        if (const std::size_t most = limits_.specsOf(bytes_.size(), kCrateBytesPerSpec); said > most)
            return fail(ErrorCode::kLimit, fmt::format("it has more than {} prims and properties", most));
        const auto paths = unpackUsdIntegers<std::uint32_t>(*in, said);
        const auto fields = unpackUsdIntegers<std::uint32_t>(*in, said);
        const auto kinds = unpackUsdIntegers<std::uint32_t>(*in, said);
        if (!paths || !fields || !kinds || !in->good()) return cut("specs");
        for (std::uint64_t i = 0; i < said; ++i) specs_.push_back({(*paths)[i], (*fields)[i], (*kinds)[i]});
        return {};
    }

    /// The prim, or the variant, at a path; made where it is not there yet. Null: the path is of neither.
    UsdPrim* primAt(std::uint32_t index) {
        if (index >= tables_.paths.size() || !tables_.paths[index].known) return nullptr;
        if (const auto known = prims_.find(index); known != prims_.end()) return known->second;
        const UsdCrateTables::Path& path = tables_.paths[index];
        UsdPrim* made = nullptr;
        if (path.depth == 0) {
            made = &layer_->root;
        } else if (!path.isProperty) {
            // Parents are as deep as paths may be, at most.
            if (UsdPrim* const parent = primAt(path.parent)) made = childOf(*parent, path.name);
        }
        prims_.emplace(index, made);
        return made;
    }
    static UsdPrim* childOf(UsdPrim& parent, const std::string& name) {
        if (!name.starts_with('{')) {
            const bool sound = !name.empty() && name.find_first_of("/.[]<>") == std::string::npos;
            return sound ? &parent.children.at(name) : nullptr;
        }
        const std::size_t equal = name.find('=');
        if (equal == std::string::npos || !name.ends_with('}') || equal + 2 >= name.size()) return nullptr;
        const std::string set = name.substr(1, equal - 1);
        std::vector<UsdVariantSet>& sets = parent.needArcs().variantSets;
        auto found = std::ranges::find(sets, set, &UsdVariantSet::name);
        if (found == sets.end()) found = sets.insert(sets.end(), UsdVariantSet{set, {}});
        return &found->variants.at(name.substr(equal + 1, name.size() - equal - 2));
    }

    Expected<void> addSpec(const Spec& spec) {
        const bool isProperty = spec.kind == kAttributeSpec || spec.kind == kRelationshipSpec;
        if (!isProperty && spec.kind != kPrimSpec && spec.kind != kRootSpec && spec.kind != kVariantSpec) return {};
        if (spec.path >= tables_.paths.size()) return cut("specs");
        const UsdCrateTables::Path& path = tables_.paths[spec.path];
        UsdPrim* const prim = primAt(isProperty ? path.parent : spec.path);
        if (prim == nullptr || (isProperty && (!path.isProperty || path.name.empty()))) return {};
        UsdProperty* const property = isProperty ? &prim->properties[path.name] : nullptr;
        for (std::uint64_t i = spec.fields; i < fieldSets_.size() && fieldSets_[i] < fields_.size(); ++i) {
            const Field& field = fields_[fieldSets_[i]];
            const std::string& name = values_->token(field.name);
            if (isForPeople(name)) continue;
            Expected<void> done =
                property != nullptr ? setProperty(*property, name, field.value) : setPrim(*prim, name, field.value);
            if (!done) return done;
            if (++fieldsRead_ > kFreeEntries + kFieldsPerSpec * specs_.size()) return cut("sets of fields");
        }
        return {};
    }
    template <typename To>
    static Expected<void> set(To& to, Expected<To> value) {
        if (!value) return tl::unexpected(value.error());
        to = std::move(*value);
        return {};
    }
    Expected<void> setMetadata(UsdMetadata& metadata, const std::string& name, UsdCrateRep rep) {
        const Expected<UsdValuePtr> value = values_->value(rep);
        if (!value) return tl::unexpected(value.error());
        metadata.insert_or_assign(name, **value);
        return {};
    }
    Expected<void> setProperty(UsdProperty& property, const std::string& name, UsdCrateRep rep) {
        if (name == "default") return set(property.value, values_->value(rep));
        if (name == "timeSamples" && rep.type() == UsdCrateValues::kTimeSamples)
            return set(property.samples, values_->samples(rep));
        if (name == "connectionPaths" || name == "targetPaths") return set(property.targets, values_->paths(rep));
        if (name == "spline") {
            property.metadata[name] = {};
            return {};
        }
        if (name != "typeName") return setMetadata(property.metadata, name, rep);
        const Expected<UsdValuePtr> type = values_->value(rep);
        if (type && (*type)->word() != nullptr) property.type = *(*type)->word();
        return {};
    }
    Expected<void> setPrim(UsdPrim& prim, const std::string& name, UsdCrateRep rep) {
        if (name == "references") return set(prim.needArcs().references, values_->references(rep));
        if (name == "payload") return set(prim.needArcs().payloads, values_->references(rep));
        if (name == "inheritPaths") return set(prim.needArcs().inherits, values_->paths(rep));
        if (name == "specializes") return set(prim.needArcs().specializes, values_->paths(rep));
        if (name == "variantSetNames") return set(prim.needArcs().variantSetNames, values_->words(rep));
        if (name == "variantSelection") return set(prim.needArcs().selections, values_->selections(rep));
        if (name == "relocates" || name == "layerRelocates") {
            prim.metadata["relocates"] = {};
            return {};
        }
        if (name == "apiSchemas") {
            const Expected<UsdListOp<std::string>> list = values_->words(rep);
            if (!list) return tl::unexpected(list.error());
            UsdValue::Words all;
            list->applyTo(all);
            prim.metadata[name].data = std::move(all);
            return {};
        }
        const Expected<UsdValuePtr> value = values_->value(rep);
        if (!value) return tl::unexpected(value.error());
        const UsdValue& said = **value;
        if (name == "specifier") {
            const double kind = said.number().value_or(1);
            prim.specifier = kind == 0   ? UsdPrim::Specifier::kDef
                             : kind == 2 ? UsdPrim::Specifier::kClass
                                         : UsdPrim::Specifier::kOver;
        } else if (name == "typeName") {
            if (said.word() != nullptr) prim.type = *said.word();
        } else if (name == "primChildren") {
            if (said.words() != nullptr) orders_.emplace_back(&prim, *said.words());
        } else if (name == "subLayers") {
            if (said.words() == nullptr) return {};
            layer_->sublayers.resize(said.words()->size());
            for (std::size_t i = 0; i < layer_->sublayers.size(); ++i) layer_->sublayers[i].asset = (*said.words())[i];
        } else if (name == "subLayerOffsets") {
            const Expected<std::vector<UsdTime>> times = values_->times(rep);
            if (!times) return tl::unexpected(times.error());
            if (layer_->sublayers.size() < times->size()) layer_->sublayers.resize(times->size());
            for (std::size_t i = 0; i < times->size(); ++i) layer_->sublayers[i].time = (*times)[i];
        } else {
            prim.metadata.insert_or_assign(name, said);
        }
        return {};
    }

    /// Sets of fields may be shared; more than so many each are lies.
    static constexpr std::uint64_t kFieldsPerSpec = 8;

    ByteSpan bytes_;
    UsdLayerLimits limits_;
    unsigned minor_ = 0;
    std::map<std::string, std::uint64_t> sections_;  ///< where they begin
    UsdCrateTables tables_;
    std::vector<Field> fields_;
    std::vector<std::uint32_t> fieldSets_;
    std::vector<Spec> specs_;
    UsdCrateValues* values_ = nullptr;
    std::shared_ptr<UsdLayer> layer_;
    std::unordered_map<std::uint32_t, UsdPrim*> prims_;  ///< by path
    std::vector<std::pair<UsdPrim*, std::vector<std::string>>> orders_;
    std::uint64_t fieldsRead_ = 0;
};

}  // namespace

bool isUsdCrate(ByteSpan bytes) {
    return asText(bytes).starts_with(kMagic);
}

Expected<std::shared_ptr<const UsdLayer>> readUsdCrate(ByteSpan bytes, std::string identifier,
                                                       const UsdLayerLimits& limits) {
    return CrateReader(bytes, std::move(identifier), limits).read();
}

}  // namespace tessera
