#include "common/scenefile/SavedText.h"

#include <fmt/format.h>
#include <google/protobuf/stubs/logging.h>

#include <algorithm>
#include <unordered_map>

#include "common/base/Hash.h"
#include "common/base/Nearest.h"
#include "common/base/OpenBraces.h"
#include "common/base/Utf8.h"
#include "common/scene/Aspect.h"
#include "common/scenefile/ArraysFile.h"
#include "common/scenefile/SavedNames.h"
#include "common/scenefile/SceneSchema.h"
#include "common/scenefile/TextForm.h"
#include "common/scenefile/TextTokens.h"

namespace tessera {
namespace {

namespace pb = google::protobuf;
using textform::Elements;

class TextReader : TextTokens {
public:
    TextReader(std::string_view text, const SavedPart& part, const SavedTextOptions& options)
        : TextTokens(text, part), options_(options), names_(items_) {
        for (const SceneSchema::Type& type : schema_.types()) types_.emplace(textform::wordOf(*type.info), &type);
    }

    Expected<SavedText> read() {
        if (Expected<void> good = next(); !good) return tl::unexpected(good.error());
        if (Expected<void> good = toBrace(); !good) return tl::unexpected(good.error());  // behind `saved`
        open_.push_back({"saved", line(), nullptr});
        items_.push_back({.type = types_.at("node"), .line = line() + 1, .column = column() + 1});
        if (Expected<void> good = insideBraces([&] { return readTop(); }); !good) return tl::unexpected(good.error());
        items_[0].end = items_.size();
        if (Expected<void> good = names_.resolve(refs_, notes_); !good) return tl::unexpected(good.error());
        if (Expected<void> good = checkArrays(); !good) return tl::unexpected(good.error());
        return finish();
    }

private:
    // ---- the form of protobuf

    static void addVarint(std::string& bytes, std::uint64_t value) {
        for (; value >= 0x80; value >>= 7) bytes.push_back(static_cast<char>(value | 0x80));
        bytes.push_back(static_cast<char>(value));
    }
    static void addTag(std::string& bytes, int field, int wire) {
        addVarint(bytes, static_cast<std::uint64_t>(field) << 3 | static_cast<std::uint64_t>(wire));
    }
    static void addBytes(std::string& bytes, int field, std::string_view value) {
        addTag(bytes, field, 2);
        addVarint(bytes, value.size());
        bytes += value;
    }
    static void addNumber(std::string& bytes, int field, std::uint64_t value) {
        addTag(bytes, field, 0);
        addVarint(bytes, value);
    }

    // ---- what stands inside

    /// A field of `saved`.
    Expected<void> readTop() {
        const std::string word = tokens_.current().text;
        if (word == textform::kArrays) return readArraysBeside();
        if (word == textform::kArray) return readArrayInside();
        if (word == textform::kRoot) {
            if (std::exchange(hasRoot_, true)) return failHere("root is there twice");
            const Place at = here();
            items_[0].line = at.line, items_[0].column = at.column;
            if (Expected<void> good = toBrace(); !good) return good;
            return readInside(word, 0, at);
        }
        if (word == textform::kNode) return readChild(0);
        if (word == textform::kUnplaced) {
            open_.push_back({word, line(), nullptr});
            if (Expected<void> good = next(); !good) return good;
            return insideBraces([&]() -> Expected<void> {
                if (tokens_.current().text != textform::kNode) return failUnknown("unplaced", {"node"});
                return readChild(kNoItem);
            });
        }
        if (const auto type = types_.find(word); type != types_.end()) {
            const Place at = here();
            if (Expected<void> good = toBrace(); !good) return good;
            return readNew(word, *type->second, at, kNoItem);
        }
        std::vector<std::string> known = {"root", "node", "unplaced", "arrays", "array"};
        for (const auto& [name, type] : types_) known.push_back(name);
        return failUnknown("saved", known);
    }

    [[nodiscard]] tl::unexpected<Error> failUnknown(std::string_view owner, const std::vector<std::string>& known) {
        const std::string& word = tokens_.current().text;
        for (std::size_t i = 0; i + 1 < open_.size(); ++i)
            if (open_[i].type && (open_[i].type->inObject->message_type()->FindFieldByName(word) ||
                                  (open_[i].type->info->type == typeOf<Node>() && types_.contains(word))))
                return failHere(fmt::format("{} has no '{}'; {}", owner, shown(),
                                            askForBrace({open_.back().name, open_.back().line})));
        const std::string nearest = nearestName(word, known);
        return failHere(fmt::format("{} has no '{}'{}", owner, shown(),
                                    nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest)));
    }

    /// Behind a word and its colon.
    Expected<void> toColon(std::string_view word) {
        if (Expected<void> good = next(); !good) return good;
        return expect(':', word);
    }
    /// Behind a word, before what it holds.
    Expected<void> toBrace() {
        if (Expected<void> good = next(); !good) return good;
        return isSymbol(':') ? next() : Expected<void>();
    }
    Expected<void> readNew(const std::string& word, const SceneSchema::Type& type, const Place& at,
                           std::size_t around) {
        if (items_.size() > SceneLimits().maxObjects)
            return failAt(at, fmt::format("the scene has more than {} objects", SceneLimits().maxObjects),
                          ErrorCode::kLimit);
        const std::size_t item = items_.size();
        items_.push_back({.type = &type, .line = at.line, .column = at.column, .around = around});
        return readInside(word, item, at);
    }
    Expected<void> readChild(std::size_t parent) {
        const Place at = here();
        if (Expected<void> good = toBrace(); !good) return good;
        const std::size_t child = items_.size();
        if (parent != kNoItem) items_[parent].children.push_back(static_cast<std::uint32_t>(child + 1));
        return readNew("node", *types_.at("node"), at, parent);
    }

    Expected<void> readInside(const std::string& word, std::size_t item, const Place& at) {
        open_.push_back({word, at.line - 1, items_[item].type});
        std::string value;
        std::uint64_t seen = 0;  // the fields that are there, by their place in the type
        if (Expected<void> good = insideBraces([&] { return readField(item, value, seen); }); !good) return good;
        items_[item].valueBegin = values_.size();
        values_ += value;
        items_[item].valueBytes = value.size();
        items_[item].end = items_.size();
        return {};
    }

    Expected<void> readField(std::size_t item, std::string& value, std::uint64_t& seen) {
        const SceneSchema::Type& type = *items_[item].type;
        const bool isNode = type.info->type == typeOf<Node>();
        const std::string word = tokens_.current().text;
        if (word == textform::kId) {
            if (!items_[item].id.empty()) return failHere("id is there twice");
            if (Expected<void> good = toColon(word); !good) return good;
            const Place at = here();
            Expected<std::string> id = text(word);
            if (!id) return tl::unexpected(id.error());
            if (id->empty() || *id == textform::kRootName || !isUtf8(*id))
                return failAt(at, "an id is a name: UTF-8, not empty, not '/'");
            items_[item].id = std::move(*id);
            return {};
        }
        if (isNode && word == textform::kNode) return readChild(item);
        std::size_t place = 0;
        while (place < type.fields.size() && type.fields[place].descriptor->name() != word) ++place;
        if (place == type.fields.size()) {
            const auto core = isNode ? types_.find(word) : types_.end();
            if (core == types_.end() || !core->second->info->isCore) return failUnknown(item, isNode);
            for (place = 0; type.fields[place].descriptor->name() != textform::kCore;) ++place;
            if (seen >> place & 1) return failHere("this node has a core already");
            seen |= std::uint64_t{1} << place;
            const Place at = here();
            if (Expected<void> good = toBrace(); !good) return good;
            return readHeld(item, type.fields[place], word, *core->second, at);
        }
        const SceneSchema::Field& field = type.fields[place];
        const bool isList = field.entry->kind == FieldKind::kRefs;
        if (seen >> place & 1 && !isList) return failHere(fmt::format("{} is there twice", word));
        seen |= std::uint64_t{1} << place;
        if (field.entry->holdsRefs()) return readRefs(item, field, word);
        if (Expected<void> good = next(); !good) return good;
        if (field.entry->kind == FieldKind::kBlob) return readArray(item, field, word);
        if (Expected<void> good = expect(':', word); !good) return good;
        return readValue(item, field, word, value);
    }

    [[nodiscard]] tl::unexpected<Error> failUnknown(std::size_t item, bool isNode) {
        const SceneSchema::Type& type = *items_[item].type;
        std::vector<std::string> known = {"id"};
        for (const SceneSchema::Field& field : type.fields) known.push_back(field.descriptor->name());
        if (isNode) {
            known.emplace_back("node");
            for (const auto& [name, other] : types_)
                if (other->info->isCore) known.push_back(name);
        }
        return failUnknown(type.info->name, known);
    }

    /// An object that stands where it is referred to.
    Expected<void> readHeld(std::size_t item, const SceneSchema::Field& field, const std::string& word,
                            const SceneSchema::Type& type, const Place& at) {
        refs_.push_back({.item = item, .field = &field, .line = at.line, .column = at.column, .target = items_.size()});
        if (items_[item].type->info->type == typeOf<Node>()) items_[item].core = items_.size();
        return readNew(word, type, at, item);
    }

    Expected<void> readRefs(std::size_t item, const SceneSchema::Field& field, const std::string& word) {
        const TypeInfo* target = field.entry->refType ? tessera::findType(*field.entry->refType) : nullptr;
        const Place at = here();
        if (Expected<void> good = next(); !good) return good;
        const Expected<bool> colon = takes(':');
        if (!colon) return tl::unexpected(colon.error());
        if (isSymbol('{')) {
            if (target && target->type != typeOf<Node>())
                return readHeld(item, field, word, *schema_.findType(SceneSchema::kFirstType + target->type.value), at);
            return failHere(
                fmt::format("{} names {} that stands elsewhere: \"name\"", word, target ? "a node" : "an object"));
        }
        if (!*colon) return expect(':', word);
        const auto one = [&]() -> Expected<void> {
            const Place named = here();
            if (!isText()) return failHere(fmt::format("{} names an object: \"name\"", word));
            const Expected<std::string> name = text(word);
            if (!name) return tl::unexpected(name.error());
            if (!isUtf8(*name)) return failAt(named, fmt::format("this {} is no UTF-8", word));
            refs_.push_back({.item = item,
                             .field = &field,
                             .line = named.line,
                             .column = named.column,
                             .kind = SavedRef::Kind::kName,
                             .target = names_.intern(*name)});
            return {};
        };
        return field.entry->kind == FieldKind::kRefs ? list(word, one) : one();
    }

    Expected<void> readValue(std::size_t item, const SceneSchema::Field& field, const std::string& word,
                             std::string& value) {
        const int number = field.descriptor->number();
        switch (field.entry->kind) {
            case FieldKind::kFloat:
                return readNumbers<float>(field, word, value);
            case FieldKind::kDouble:
            case FieldKind::kMatrix:
                return readNumbers<double>(field, word, value);
            case FieldKind::kInt: {
                if (field.descriptor->enum_type() && tokens_.current().type == Tokenizer::TYPE_IDENTIFIER)
                    return readWord(*field.descriptor->enum_type(), word, number, value);
                const Expected<std::int64_t> whole =
                    field.descriptor->enum_type()
                        ? this->number<std::int32_t>(word).map([](std::int32_t n) { return std::int64_t{n}; })
                        : this->number<std::int64_t>(word);
                if (!whole) return tl::unexpected(whole.error());
                addNumber(value, number, static_cast<std::uint64_t>(*whole));
                return {};
            }
            case FieldKind::kText: {
                const Place at = here();
                const Expected<std::string> said = text(word);
                if (!said) return tl::unexpected(said.error());
                if (!isUtf8(*said)) return failAt(at, fmt::format("this {} is no UTF-8", word));
                addBytes(value, number, *said);
                if (items_[item].type->info->type == typeOf<Node>() && word == "name") items_[item].name = *said;
                return {};
            }
            case FieldKind::kBool: {
                const std::string& said = tokens_.current().text;
                const bool yes = said == "true" || said == "True" || said == "t" || said == "1";
                if (!yes && said != "false" && said != "False" && said != "f" && said != "0")
                    return failHere(fmt::format("{} is true or false, not '{}'", word, shown()));
                addNumber(value, number, yes ? 1 : 0);
                return next();
            }
            default:
                return {};
        }
    }

    template <typename T>
    Expected<void> readNumbers(const SceneSchema::Field& field, const std::string& word, std::string& value) {
        std::string numbers;
        const auto one = [&]() -> Expected<void> {
            const Expected<T> read = number<T>(word);
            if (!read) return tl::unexpected(read.error());
            numbers.append(reinterpret_cast<const char*>(&*read), sizeof(T));
            // Nobody needs more to see that they are too many.
            if (numbers.size() > 4096) return failHere(fmt::format("{} has too many numbers", word));
            return {};
        };
        if (!field.descriptor->is_repeated()) {
            if (Expected<void> good = one(); !good) return good;
            addTag(value, field.descriptor->number(), sizeof(T) == 4 ? 5 : 1);
            value += numbers;
            return {};
        }
        if (Expected<void> good = list(word, one); !good) return good;
        addBytes(value, field.descriptor->number(), numbers);
        return {};
    }

    Expected<void> readWord(const pb::EnumDescriptor& words, const std::string& word, int at, std::string& value) {
        const std::string& said = tokens_.current().text;
        std::vector<std::string> known;
        for (int i = 0; i < words.value_count(); ++i) {
            const std::string& name = words.value(i)->name();
            // As it stands in the schema, or as authors write it: without the field's own name.
            if (name != said && (name.size() <= said.size() || name != textform::enumHead(word) + said)) {
                known.push_back(name);
                continue;
            }
            addNumber(value, at, static_cast<std::uint64_t>(std::int64_t{words.value(i)->number()}));
            return next();
        }
        const std::string nearest = nearestName(said, known);
        return failHere(fmt::format("{} cannot be {}{} (it can be {})", word, shown(),
                                    nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest),
                                    fmt::join(known, ", ")));
    }

    // ---- arrays

    Expected<void> readArray(std::size_t item, const SceneSchema::Field& field, const std::string& word) {
        const Expected<bool> colon = takes(':');
        if (!colon) return tl::unexpected(colon.error());
        SavedRef ref{.item = item, .field = &field, .line = line() + 1, .column = column() + 1};
        if (isSymbol('{')) {
            bool isSaid = false;
            open_.push_back({word, line(), nullptr});
            if (Expected<void> good = insideBraces([&]() -> Expected<void> {
                    if (tokens_.current().text != textform::kArray) return failUnknown(word, {"array"});
                    if (std::exchange(isSaid, true)) return failHere("array is there twice");
                    if (Expected<void> said = toColon(textform::kArray); !said) return said;
                    const Expected<std::uint32_t> number = this->number<std::uint32_t>(textform::kArray);
                    if (!number) return tl::unexpected(number.error());
                    ref.target = *number;
                    return {};
                });
                !good)
                return good;
            if (!isSaid || ref.target == 0) return failAt({ref.line, ref.column}, "arrays are counted from 1");
            ref.kind = SavedRef::Kind::kNamedArray;
            refs_.push_back(ref);
            return {};
        }
        if (!*colon) return expect(':', word);
        Bytes bytes;
        if (isText()) {
            const Expected<std::string> said = text(word);
            if (!said) return tl::unexpected(said.error());
            const ByteSpan content = asBytes(*said);
            bytes.assign(content.begin(), content.end());
        } else if (isSymbol('[')) {
            if (Expected<void> good = readElements(*field.entry, word, bytes); !good) return good;
        } else {
            return failHere(fmt::format("{} is an array: [numbers], \"bytes\" or {{ array: N }}", word));
        }
        ref.kind = SavedRef::Kind::kOwnArray;
        ref.target = ownArray(std::move(bytes));
        refs_.push_back(ref);
        return {};
    }

    Expected<void> readElements(const FieldEntry& entry, const std::string& word, Bytes& bytes) {
        const Elements elements = textform::elementsOf(entry);
        const auto of = [&]<typename T>(T) {
            return list(word, [&]() -> Expected<void> {
                const Expected<T> read = number<T>(word);
                if (!read) return tl::unexpected(read.error());
                const auto* from = reinterpret_cast<const std::byte*>(&*read);
                bytes.insert(bytes.end(), from, from + sizeof(T));
                return {};
            });
        };
        if (elements.kind == Elements::Kind::kNone)
            return failHere(fmt::format("{} holds bytes, not numbers: \"bytes\" or {{ array: N }}", word));
        return textform::withNumber(elements.kind, of, Expected<void>());
    }

    /// Equal ones stand there once.
    std::size_t ownArray(Bytes bytes) {
        const Hash128 hash = hash128(bytes);
        const auto [first, last] = ownByHash_.equal_range(hash);
        for (auto at = first; at != last; ++at)
            if (own_[at->second] == bytes) return at->second;
        ownByHash_.emplace(hash, own_.size());
        own_.push_back(std::move(bytes));
        return own_.size() - 1;
    }

    Expected<void> readArrayInside() {
        if (Expected<void> good = toColon(textform::kArray); !good) return good;
        const Expected<std::string> said = text(textform::kArray);
        if (!said) return tl::unexpected(said.error());
        const ByteSpan content = asBytes(*said);
        inside_.emplace_back(content.begin(), content.end());
        return {};
    }

    Expected<void> readArraysBeside() {
        const Place at = here();
        if (std::exchange(hasArrays_, true)) return failHere("arrays is there twice");
        open_.push_back({"arrays", line(), nullptr});
        if (Expected<void> good = next(); !good) return good;
        std::string file, id;
        bool saysFile = false, saysId = false;
        if (Expected<void> good = insideBraces([&]() -> Expected<void> {
                const std::string word = tokens_.current().text;
                if (word != textform::kFile && word != textform::kId) return failUnknown("arrays", {"file", "id"});
                if (std::exchange(word == textform::kFile ? saysFile : saysId, true))
                    return failHere(fmt::format("{} is there twice", word));
                if (Expected<void> colon = toColon(word); !colon) return colon;
                Expected<std::string> said = text(word);
                if (!said) return tl::unexpected(said.error());
                (word == textform::kFile ? file : id) = std::move(*said);
                return {};
            });
            !good)
            return good;
        if (!isArraysName(file) || !isUtf8(file))
            return failAt(at,
                          "the arrays lie beside the text: `file` is a name that ends in .arrays, without a folder");
        const Expected<Bytes> bytes = options_.beside
                                          ? options_.beside(file)
                                          : Expected<Bytes>(fail(ErrorCode::kNotFound, "there is no place beside it"));
        if (!bytes)
            return failAt(
                at,
                fmt::format("its arrays lie in '{}' beside it, which cannot be read: {}", file, bytes.error().message),
                bytes.error().code);
        Expected<std::vector<Bytes>> arrays = readArrays(*bytes, id);
        if (!arrays) return failAt(at, fmt::format("the file '{}' beside it {}", file, arrays.error().message));
        beside_ = std::move(*arrays);
        return {};
    }

    Expected<void> checkArrays() {
        const std::size_t count = beside_.size() + inside_.size();
        for (const SavedRef& ref : refs_)
            if (ref.kind == SavedRef::Kind::kNamedArray && ref.target > count)
                return failAt({ref.line, ref.column},
                              fmt::format("there is no array {}: the scene has {}", ref.target, count));
        return {};
    }

    // ---- all of it

    Expected<SavedText> finish() {
        SavedText result;
        result.notes = std::move(notes_);
        for (std::vector<Bytes>* some : {&beside_, &inside_, &own_})
            for (Bytes& array : *some) result.arrays.push_back(std::move(array));
        const std::size_t firstOwn = options_.firstArray + result.arrays.size() - own_.size();
        std::stable_sort(refs_.begin(), refs_.end(),
                         [](const SavedRef& a, const SavedRef& b) { return a.item < b.item; });
        const auto numberOf = [&](const SavedRef& ref) -> std::uint64_t {
            switch (ref.kind) {
                case SavedRef::Kind::kNamedArray:
                    return options_.firstArray + ref.target - 1;
                case SavedRef::Kind::kOwnArray:
                    return firstOwn + ref.target;
                default:
                    return ref.target + 1;
            }
        };
        auto ref = refs_.begin();
        std::string object, value, part;
        std::string& saved = result.saved;
        saved.reserve(values_.size() + items_.size() * 32);
        for (std::size_t i = 0; i < items_.size(); ++i) {
            const SavedItem& item = items_[i];
            value.assign(values_, item.valueBegin, item.valueBytes);
            for (; ref != refs_.end() && ref->item == i; ++ref)
                addNumber(value, ref->field->descriptor->number(), numberOf(*ref));
            object.clear();
            addNumber(object, SceneSchema::kNumber, i + 1);
            if (!item.children.empty()) {
                part.clear();
                for (const std::uint32_t child : item.children) addVarint(part, child);
                addBytes(object, SceneSchema::kChild, part);
            }
            part.clear();
            addNumber(part, 1, static_cast<std::uint64_t>(item.line));
            addNumber(part, 2, static_cast<std::uint64_t>(item.column));
            addBytes(object, SceneSchema::kAt, part);
            addBytes(object, item.type->inObject->number(), value);
            addBytes(saved, SceneSchema::kObject, object);
        }
        addNumber(saved, SceneSchema::kRoot, 1);
        addNumber(saved, SceneSchema::kNamed, 1);
        if (saved.size() > 0x7fffffff) return fail(ErrorCode::kLimit, "it is larger than 2 GiB");
        return result;
    }

    const SceneSchema& schema_ = SceneSchema::get();
    const SavedTextOptions& options_;
    std::unordered_map<std::string, const SceneSchema::Type*> types_;
    std::vector<SavedItem> items_;
    SavedNames names_;
    std::vector<SavedRef> refs_;
    std::string values_;
    std::vector<Bytes> beside_, inside_, own_;
    std::unordered_multimap<Hash128, std::size_t> ownByHash_;
    std::vector<std::string> notes_;
    bool hasRoot_ = false, hasArrays_ = false;
};

}  // namespace

Expected<SavedText> readSavedText(std::string_view text, const SavedPart& part, const SavedTextOptions& options) {
    pb::LogSilencer silence;  // what is wrong is said by the error
    return TextReader(text, part, options).read();
}

}  // namespace tessera
