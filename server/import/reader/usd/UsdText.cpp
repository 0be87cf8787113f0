#include "server/import/reader/usd/UsdText.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "server/import/reader/usd/UsdTextCursor.h"

namespace tessera {
namespace {

/// What a list of a file does to weaker ones.
enum class ListWord { kNone, kAdd, kPrepend, kAppend, kDelete, kReorder };

/// What samples over time may take beyond a multiple of the text's own size: each is a few letters there.
constexpr std::size_t kFreeSampleBytes = std::size_t{256} << 20, kSampleBytesPerByte = 8;
/// "float3 xformOp:scale = (1, 1, 1)": few are shorter.
constexpr std::size_t kTextBytesPerSpec = 32;
/// Of a value that is kept by itself, whatever it is.
constexpr std::size_t kBytesPerSample = 160;

class UsdTextReader {
public:
    UsdTextReader(std::string_view text, std::string identifier, const UsdLayerLimits& limits)
        : in_(text),
          mostSpecs_(limits.specsOf(text.size(), kTextBytesPerSpec)),
          sampleBytes_(kFreeSampleBytes + kSampleBytesPerByte * text.size()),
          limits_(limits),
          layer_(std::make_shared<UsdLayer>()) {
        layer_->identifier = std::move(identifier);
        readVersion(text);
    }

    Expected<std::shared_ptr<const UsdLayer>> read() {
        if ((in_.next() == '(' && !layerMetadata()) || !contents(layer_->root, "", 0) ||
            (in_.next() != '\0' && !in_.fault("'}' without '{'")) || in_.failed())
            return in_.error();
        return std::shared_ptr<const UsdLayer>(std::move(layer_));
    }

private:
    bool countSpec() {
        return ++specs_ <= mostSpecs_ ||
               in_.fault(fmt::format("it has more than {} prims and properties", mostSpecs_), ErrorCode::kLimit);
    }
    /// "#usda 1.0": what is of another version may be read wrong.
    void readVersion(std::string_view text) {
        const std::string_view head = text.substr(0, text.find_first_of("\r\n"));
        const std::size_t at = head.find_first_of("0123456789");
        if (at == std::string_view::npos) return;
        const std::string_view version = head.substr(at, head.find_first_not_of("0123456789.", at) - at);
        if (version != "1" && !version.starts_with("1."))
            layer_->remarks.emplace_back("text of other versions than 1 is read as if it were of that",
                                         fmt::format("{} in {}", version, layer_->identifier));
    }
    ListWord listWord() {
        if (in_.acceptWord("prepend")) return ListWord::kPrepend;
        if (in_.acceptWord("append")) return ListWord::kAppend;
        if (in_.acceptWord("add")) return ListWord::kAdd;
        if (in_.acceptWord("delete")) return ListWord::kDelete;
        if (in_.acceptWord("reorder")) return ListWord::kReorder;
        return ListWord::kNone;
    }
    template <typename Item>
    static void put(ListWord word, std::vector<Item> items, UsdListOp<Item>& list) {
        const auto behind = [&](std::vector<Item>& to) { to.insert(to.end(), items.begin(), items.end()); };
        switch (word) {
            case ListWord::kAdd:
                return behind(list.added);
            case ListWord::kPrepend:
                return behind(list.prepended);
            case ListWord::kAppend:
                return behind(list.appended);
            case ListWord::kDelete:
                return behind(list.deleted);
            case ListWord::kReorder:
                return behind(list.ordered);
            default:
                list.isExplicit = true;
                list.items = std::move(items);
        }
    }

    /// `None`, one, or a list in brackets.
    template <typename Item, typename Read>
    bool items(std::vector<Item>& out, Read&& read) {
        if (in_.acceptWord("None")) return true;
        if (!in_.accept('[')) return read(out.emplace_back());
        while (!in_.accept(']')) {
            if (!read(out.emplace_back())) return false;
            if (!in_.accept(',') && in_.next() != ']') return in_.fault("']' is missing");
        }
        return true;
    }
    bool path(std::string& out, const std::string& prim) {
        std::string said;
        if (!in_.path(said)) return false;
        if (said.empty()) return true;  // blocks a default prim, nothing else
        out = absoluteUsdPath(said, prim);
        return !out.empty() || in_.fault(fmt::format("the path <{}> leads out of the scene", said));
    }
    bool layerOffset(UsdTime& time) {
        if (!in_.accept('(')) return true;
        while (!in_.accept(')')) {
            std::string_view key;
            if (!in_.identifier(key)) return in_.fault("a name is missing");
            if (!in_.expect('=', "behind a name")) return false;
            if (key == "offset" ? !in_.number(time.offset) : key == "scale" && !in_.number(time.scale)) return false;
            UsdValue other;
            if (key != "offset" && key != "scale" && !in_.anyValue(other)) return false;
            while (in_.accept(';') || in_.accept(',')) {
            }
        }
        if (!std::isfinite(time.offset) || !std::isfinite(time.scale) || time.scale == 0) time = {};
        return true;
    }
    bool reference(UsdReference& out, const std::string& prim) {
        if (in_.next() == '@' && !in_.asset(out.asset)) return false;
        if (in_.next() == '<' || out.asset.empty())
            if (!path(out.path, prim)) return false;
        return layerOffset(out.time);
    }

    bool layerMetadata() {
        return metadata([&](std::string_view key, ListWord word) {
            if (key != "subLayers") return any(layer_->root.metadata, key, word);
            return items(layer_->sublayers,
                         [&](UsdSublayer& out) { return in_.asset(out.asset) && layerOffset(out.time); });
        });
    }
    /// `( … )`, each entry by `read`.
    template <typename Read>
    bool metadata(Read&& read) {
        if (!in_.expect('(', "before metadata")) return false;
        std::string documentation;
        while (!in_.accept(')')) {
            if (in_.accept(';') || in_.accept(',')) continue;
            if (in_.next() == '"' || in_.next() == '\'') {
                if (!in_.string(documentation)) return false;
                continue;
            }
            const ListWord word = listWord();
            std::string_view key;
            if (!in_.identifier(key)) return in_.fault("a name of metadata is missing");
            if (!in_.expect('=', "behind a name of metadata") || !read(key, word)) return false;
        }
        return true;
    }
    bool any(UsdMetadata& to, std::string_view key, ListWord word) {
        if (key == "relocates") {
            to.insert_or_assign(std::string(key), UsdValue());
            return in_.skipBrackets();
        }
        UsdValue value;
        if (!in_.anyValue(value)) return false;
        if (word == ListWord::kDelete || word == ListWord::kReorder) return true;
        // Of lists that are added to, as those of applied schemas are, all that is named counts.
        const auto known = to.find(key);
        if (const UsdValue::Words* more = value.words();
            word != ListWord::kNone && more != nullptr && known != to.end() && known->second.words() != nullptr) {
            UsdValue::Words all = *known->second.words();
            all.insert(all.end(), more->begin(), more->end());
            known->second.data = std::move(all);
        } else {
            to.insert_or_assign(std::string(key), std::move(value));
        }
        return true;
    }
    bool primMetadata(UsdPrim& prim, const std::string& path) {
        return metadata([&](std::string_view key, ListWord word) {
            if (key == "references" || key == "payload") {
                std::vector<UsdReference> list;
                if (!items(list, [&](UsdReference& out) { return reference(out, path); })) return false;
                put(word, std::move(list), key == "payload" ? prim.needArcs().payloads : prim.needArcs().references);
                return true;
            }
            if (key == "inherits" || key == "specializes") {
                std::vector<std::string> list;
                if (!items(list, [&](std::string& out) { return this->path(out, path); })) return false;
                put(word, std::move(list), key == "inherits" ? prim.needArcs().inherits : prim.needArcs().specializes);
                return true;
            }
            if (key == "variantSets") {
                std::vector<std::string> list;
                if (!items(list, [&](std::string& out) { return in_.string(out); })) return false;
                put(word, std::move(list), prim.needArcs().variantSetNames);
                return true;
            }
            if (key == "variants") {
                UsdValue chosen;
                if (!in_.dictionary(chosen)) return false;
                for (const auto& [set, name] : *chosen.dictionary())
                    if (name.word() != nullptr) prim.needArcs().selections[set] = *name.word();
                return true;
            }
            return any(prim.metadata, key, word);
        });
    }

    /// What stands in a prim's braces, or in the file. `path`: of the prim, "" of the file.
    bool contents(UsdPrim& prim, const std::string& path, std::size_t depth) {
        for (;;) {
            while (in_.accept(';')) {
            }
            if (in_.next() == '\0' || in_.next() == '}') return !in_.failed();
            const ListWord word = listWord();
            std::string_view first;
            if (!in_.identifier(first)) return in_.fault("a prim or a property is missing");
            if (word == ListWord::kReorder &&
                (first == "nameChildren" || first == "rootPrims" || first == "properties")) {
                UsdValue order;
                if (!in_.expect('=', "behind what is ordered") || !in_.anyValue(order)) return false;
                if (first != "properties" && order.words() != nullptr) prim.metadata["primOrder"] = order;
                continue;
            }
            if (first == "def" || first == "over" || first == "class") {
                if (!child(prim, path, first, depth)) return false;
            } else if (first == "variantSet") {
                if (!variantSet(prim, path, depth)) return false;
            } else if (!property(prim, path, first, word)) {
                return false;
            }
        }
    }
    bool child(UsdPrim& parent, const std::string& parentPath, std::string_view specifier, std::size_t depth) {
        if (depth >= limits_.maxDepth)
            return in_.fault(fmt::format("prims are nested deeper than {} levels", limits_.maxDepth),
                             ErrorCode::kLimit);
        std::string_view type;
        if (in_.next() != '"' && in_.next() != '\'' && !in_.identifier(type))
            return in_.fault("the name of a prim is missing");
        std::string name;
        if (!in_.string(name)) return false;
        if (name.empty() || name.find_first_of("/.{}<>") != std::string::npos)
            return in_.fault(fmt::format("'{}' is no name of a prim", name));
        if (!countSpec()) return false;
        if (parent.children.find(name) != nullptr && layer_->remarks.size() < kMostRemarks) {
            const std::string line =
                layer_->remarks.size() < kMostLines ? fmt::format(" at line {}", in_.line()) : std::string();
            layer_->remarks.emplace_back("prims of one name count as one, which has what is said last",
                                         fmt::format("{}/{}{} of {}", parentPath, name, line, layer_->identifier));
        }
        UsdPrim& prim = parent.children.at(name);
        prim.specifier = specifier == "def"     ? UsdPrim::Specifier::kDef
                         : specifier == "class" ? UsdPrim::Specifier::kClass
                                                : UsdPrim::Specifier::kOver;
        prim.type = type;
        const std::string path = parentPath + "/" + name;
        if (in_.next() == '(' && !primMetadata(prim, path)) return false;
        return in_.expect('{', fmt::format("before what is in prim '{}'", name)) && contents(prim, path, depth + 1) &&
               in_.expect('}', fmt::format("behind what is in prim '{}'", name));
    }
    bool variantSet(UsdPrim& prim, const std::string& path, std::size_t depth) {
        std::string name;
        if (!in_.string(name)) return false;
        std::vector<UsdVariantSet>& sets = prim.needArcs().variantSets;
        auto set = std::ranges::find(sets, name, &UsdVariantSet::name);
        if (set == sets.end()) set = sets.insert(sets.end(), UsdVariantSet{name, {}});
        if (depth >= limits_.maxDepth) return in_.fault("variants are nested too deep", ErrorCode::kLimit);
        if (!in_.expect('=', "behind a variant set") || !in_.expect('{', "before variants")) return false;
        // Sets are moved when more of them come: not before this one is read, as those within are a variant's own.
        UsdVariantSet made = std::move(*set);
        const auto place = static_cast<std::size_t>(set - sets.begin());
        while (!in_.accept('}')) {
            std::string variant;
            if (!in_.string(variant) || !countSpec()) return false;
            UsdPrim& content = made.variants.at(variant);
            if (in_.next() == '(' && !primMetadata(content, path)) return false;
            if (!in_.expect('{', "before a variant") || !contents(content, path, depth + 1) ||
                !in_.expect('}', "behind a variant"))
                return false;
        }
        prim.arcs->variantSets[place] = std::move(made);
        return true;
    }

    bool property(UsdPrim& prim, const std::string& path, std::string_view first, ListWord word) {
        std::string_view type = first;
        bool uniform = false;
        while (type == "custom" || type == "uniform" || type == "varying" || type == "config") {
            uniform = uniform || type == "uniform";
            if (!in_.identifier(type)) return in_.fault("the type of a property is missing");
        }
        std::string typeName(type);
        if (in_.acceptHere('[')) {
            if (!in_.expect(']', "behind a type of lists")) return false;
            typeName += "[]";
        }
        std::string_view name;
        if (!in_.identifier(name))
            return in_.fault(fmt::format("the name of a property is missing behind {}", typeName));
        const auto [entry, isNew] = prim.properties.try_emplace(std::string(name));
        if (isNew && !countSpec()) return false;
        UsdProperty& property = entry->second;
        if (type == "rel") return relationship(property, path, word);
        property.type = typeName;
        std::string_view part;
        if (in_.acceptHere('.') && !in_.identifier(part)) return in_.fault("a word is missing behind the dot");
        if (part == "connect") {
            std::vector<std::string> targets;
            if (!in_.expect('=', "before a connection") ||
                !items(targets, [&](std::string& out) { return this->path(out, path); }))
                return false;
            put(word, std::move(targets), property.targets);
        } else if (part == "timeSamples") {
            if (!in_.expect('=', "before samples") || !samples(property)) return false;
        } else if (part == "spline") {
            property.metadata["spline"] = {};
            if (!in_.expect('=', "before a spline") || !in_.skipBrackets()) return false;
        } else if (!part.empty() && part != "default") {
            return in_.fault(fmt::format("'.{}' is unknown here", part));
        } else if (in_.accept('=')) {
            UsdValue value;
            if (!in_.value(usdTypeOf(typeName), typeName, value)) return false;
            property.value = std::make_shared<const UsdValue>(std::move(value));
        }
        return propertyMetadata(property);
    }
    bool propertyMetadata(UsdProperty& property) {
        return in_.next() != '(' ||
               metadata([&](std::string_view key, ListWord list) { return any(property.metadata, key, list); });
    }
    bool relationship(UsdProperty& property, const std::string& path, ListWord word) {
        if (in_.accept('=')) {
            std::vector<std::string> targets;
            if (!items(targets, [&](std::string& out) { return this->path(out, path); })) return false;
            put(word, std::move(targets), property.targets);
        }
        return propertyMetadata(property);
    }
    bool samples(UsdProperty& property) {
        const UsdType type = usdTypeOf(property.type);
        if (!in_.expect('{', "before samples")) return false;
        property.samples.clear();
        while (!in_.accept('}')) {
            double time = 0;
            UsdValue value;
            if (!in_.number(time) || !in_.expect(':', "behind the time of a sample") ||
                !in_.value(type, property.type, value))
                return false;
            const std::size_t bytes = kBytesPerSample + value.bytes();
            if (bytes > sampleBytes_)
                return in_.fault("its samples over time take far more memory than a file of its size may",
                                 ErrorCode::kLimit);
            sampleBytes_ -= bytes;
            if (std::isfinite(time))
                property.samples.emplace_back(time, std::make_shared<const UsdValue>(std::move(value)));
            if (!in_.accept(',') && in_.next() != '}') return in_.fault("'}' is missing behind samples");
        }
        std::ranges::stable_sort(property.samples, {}, [](const auto& sample) { return sample.first; });
        return true;
    }

    /// Looking for the line of one takes its time.
    static constexpr std::size_t kMostRemarks = 10'000, kMostLines = 10;

    UsdTextCursor in_;
    std::size_t mostSpecs_, sampleBytes_;
    const UsdLayerLimits& limits_;
    std::shared_ptr<UsdLayer> layer_;
    std::size_t specs_ = 0;
};

}  // namespace

std::string absoluteUsdPath(std::string_view path, std::string_view prim) {
    if (path.starts_with('/')) return std::string(path);
    std::string at(prim);
    while (path.starts_with("..")) {
        if (at.empty()) return {};
        at.resize(at.rfind('/'));
        path.remove_prefix(std::min<std::size_t>(path.starts_with("../") ? 3 : 2, path.size()));
    }
    if (path.starts_with("./")) path.remove_prefix(2);
    if (path.empty() || path == ".") return at.empty() ? "/" : at;
    return path.front() == '.' ? at + std::string(path) : at + "/" + std::string(path);
}

bool isUsdText(std::string_view text) {
    if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
    return text.starts_with("#usda") || text.starts_with("#sdf");
}

Expected<std::shared_ptr<const UsdLayer>> parseUsdText(std::string_view text, std::string identifier,
                                                       const UsdLayerLimits& limits) {
    using namespace std::string_view_literals;
    if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
    for (const std::string_view wide : {"\xff\xfe"sv, "\xfe\xff"sv, "#\0"sv, "\0#"sv})
        if (text.starts_with(wide))
            return fail(ErrorCode::kBadInput,
                        "1:1: it is text of UTF-16, and text of USD is UTF-8: an editor, or iconv -f UTF-16 -t UTF-8, "
                        "saves it so");
    if (!isUsdText(text)) return fail(ErrorCode::kBadInput, "1:1: text of USD begins with '#usda 1.0'");
    return UsdTextReader(text, std::move(identifier), limits).read();
}

}  // namespace tessera
