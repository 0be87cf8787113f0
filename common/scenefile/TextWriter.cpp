#include "common/scenefile/TextWriter.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <unordered_map>
#include <unordered_set>

#include "common/base/Utf8.h"
#include "common/base/Version.h"
#include "common/scenefile/SceneSchema.h"
#include "common/scenefile/TextForm.h"

namespace tessera {
namespace {

using textform::Elements;

constexpr std::size_t kWidth = 120;           // of a line
constexpr std::size_t kDeepestIndent = 64;    // of a line: what is deeper stands below each other
constexpr std::size_t kMostNumbers = 32;      // of an array that stands where it is used
constexpr std::size_t kMostSaid = 1024;       // numbers of it, wherever it is used
constexpr std::size_t kMostTextBytes = 2048;  // of an array that is a text
constexpr std::size_t kMostBytes = 32;        // of an array of bytes
constexpr std::size_t kDeepestInside = 4;     // objects inside of each other, nodes and cores not counted
constexpr std::size_t kLongestName = 200;     // bytes, of a node's that others refer to it by

bool isNode(const Object& object) {
    return object.info().type == typeOf<Node>();
}

bool isPlainText(std::string_view text) {
    return isUtf8(text) && std::none_of(text.begin(), text.end(), [](unsigned char c) {
               return (c < ' ' && c != '\n' && c != '\t') || c == 0x7f;
           });
}

class NestedWriter {
public:
    explicit NestedWriter(const Aspect& scene) : scene_(scene) {}

    Expected<WrittenText> write() {
        if (Expected<void> here = collect(); !here) return tl::unexpected(here.error());
        settle();
        giveNames();
        for (const std::size_t place : shared_) put(wordOf(place), place, 1);
        if (!shared_.empty()) text_ += '\n';
        const Node& root = scene_.root();
        if (rootIsSaid_) {
            put(textform::kRoot, 0, 1);
        } else {
            putChildren(root, 1);
        }
        bool any = false;
        for (std::size_t i = 0; i < held_.size(); ++i) {
            if (i == 0 || !isNode(held_[i].object) || held_[i].isChild) continue;
            if (!std::exchange(any, true)) line(1), text_ += "unplaced {";
            put(textform::kNode, i, 2);
        }
        if (any) line(1), text_ += "}";
        if (text_.empty()) put(textform::kRoot, 0, 1);
        return WrittenText{std::move(text_), std::move(arrays_)};
    }

private:
    struct Held {
        Object object;
        std::size_t holder = 0;                           ///< whose field refers to it: the first
        std::uint32_t cores = 0, typed = 0, untyped = 0;  ///< fields that refer to it
        bool isChild = false;                             ///< a node that stands below another
        bool isInside = false;                            ///< it stands where it is referred to
        bool isCoreInside = false;                        ///< … as the core of its node
        std::size_t depth = 0;                            ///< objects around it
        std::string name;                                 ///< how others refer to it
        bool saysId = false;
    };
    struct Use {
        std::size_t times = 0;
        std::uint32_t number = 0;
    };

    // ---- what there is

    Expected<void> collect() {
        ObjectsToSave objects = objectsToSave(scene_);
        places_ = std::move(objects.places);
        for (const ObjectId id : objects.order) {
            held_.push_back({.object = scene_.find(id)});
            if (Expected<void> here = countArrays(id, held_.back().object); !here) return here;
        }
        for (std::size_t i = 0; i < held_.size(); ++i) countRefs(i);
        return {};
    }

    Expected<void> countArrays(ObjectId id, const Object& object) {
        for (const FieldEntry& field : object.info().fields) {
            if (field.kind != FieldKind::kBlob) continue;
            const Blob blob = std::get<Blob>(field.load(object));
            if (blob.empty()) continue;
            if (!blob.resident())
                return fail(ErrorCode::kRefused, fmt::format("the {} of {} #{} ({} bytes) are not here", field.name,
                                                             object.info().name, id.value, blob.sizeBytes()));
            ++uses_[blob.id()].times;
        }
        return {};
    }

    void countRefs(std::size_t place) {
        const Object object = held_[place].object;
        if (const Node* node = object.as<Node>()) {
            for (const ObjectId child : node->children)
                if (!scene_.get<Node>(child)->ofServer) held_[places_.at(child)].isChild = true;
            if (node->core) {
                Held& core = held_[places_.at(node->core)];
                if (core.cores++ == 0) core.holder = place;
            }
            return;
        }
        if (!object.info().refers) return;
        for (const FieldEntry& field : object.info().fields) {
            if (!field.holdsRefs()) continue;
            const FieldValue value = field.load(object);
            const auto count = [&](ObjectId id) {
                Held& target = held_[places_.at(id)];
                ++(field.refType ? target.typed : target.untyped);
                if (target.cores == 0) target.holder = place;
            };
            if (const auto* one = std::get_if<ObjectId>(&value); one && *one) count(*one);
            if (const auto* list = std::get_if<RefList>(&value)) std::for_each(list->begin(), list->end(), count);
        }
    }

    /// Where each object stands. What holds an object comes before it.
    void settle() {
        const Node& root = scene_.root();
        rootIsSaid_ = !root.name.empty() || root.core || root.levels != 0 || root.ofServer;
        for (std::size_t i = 1; i < held_.size(); ++i) {
            Held& held = held_[i];
            if (isNode(held.object)) continue;
            if (held.cores == 1) {
                held.isInside = held.isCoreInside = true;
                continue;
            }
            if (held.cores == 0 && held.typed == 1 && held.untyped == 0) {
                const Held& holder = held_[held.holder];
                held.depth = holder.depth + 1;
                held.isInside = held.holder < i && held.depth <= kDeepestInside;
            }
            if (held.isInside) continue;
            held.depth = 0;
            shared_.push_back(i);
        }
        std::stable_sort(shared_.begin(), shared_.end(), [&](std::size_t a, std::size_t b) {
            return held_[a].object.info().isCore < held_[b].object.info().isCore;
        });
    }

    void giveNames() {
        std::unordered_map<std::string_view, std::size_t> nodes;
        for (const Held& held : held_)
            if (const Node* node = held.object.as<Node>()) ++nodes[node->name];
        held_[0].name = textform::kRootName;
        const auto isFit = [&](std::string_view name) {
            return !name.empty() && name != textform::kRootName && name.size() <= kLongestName && nodes.at(name) == 1;
        };
        std::unordered_map<std::string, std::size_t> counts;
        std::unordered_set<std::string> given;
        const auto give = [&](std::size_t place) {
            Held& held = held_[place];
            held.saysId = true;
            std::string word = wordOf(place);
            std::replace(word.begin(), word.end(), '_', '-');
            // What a node is there for is called after it.
            const Node* node = held.cores > 0 ? held_[held.holder].object.as<Node>() : nullptr;
            if (node && node->name == word) node = scene_.get<Node>(node->parent);
            if (node && !node->name.empty() && node->name != word && node->name.size() <= kLongestName)
                held.name = fmt::format("{} {}", node->name, word);
            while (held.name.empty() || nodes.contains(held.name) || !given.insert(held.name).second)
                held.name = fmt::format("{}-{}", word, ++counts[word]);
        };
        for (const std::size_t place : shared_) give(place);
        for (std::size_t i = 1; i < held_.size(); ++i) {
            Held& held = held_[i];
            if (held.typed + held.untyped == 0 || (!held.isCoreInside && !isNode(held.object))) continue;
            const Node* node = held.isCoreInside ? held_[held.holder].object.as<Node>() : held.object.as<Node>();
            if (isFit(node->name) && (!held.isCoreInside || held.untyped == 0))
                held.name = node->name;
            else
                give(i);
        }
    }

    [[nodiscard]] std::string wordOf(std::size_t place) const { return textform::wordOf(held_[place].object.info()); }

    // ---- lines

    void line(std::size_t level) {
        text_ += '\n';
        lineBegin_ = text_.size();
        text_.append(indentOf(level), ' ');
    }
    [[nodiscard]] static std::size_t indentOf(std::size_t level) { return std::min(2 * level, kDeepestIndent); }

    void put(std::string_view word, std::size_t place, std::size_t level) {
        line(level);
        const std::size_t begin = text_.size();
        text_ += word;
        putInside(place, level, begin);
    }

    /// From its brace on; the line begins at `begin`, behind its indent.
    void putInside(std::size_t place, std::size_t level, std::size_t begin) {
        const Held& held = held_[place];
        const Object& object = held.object;
        const SceneSchema::Type& type = schema_.types()[object.info().index];
        text_ += " {";
        if (held.saysId) text_ += " id: ", putText(held.name, level);
        const Node* node = object.as<Node>();
        for (const SceneSchema::Field& field : type.fields) {
            const FieldValue value = field.entry->load(object);
            if (value == field.entry->load(type.info->freshObject())) continue;
            const bool isName = node && field.entry->kind == FieldKind::kText;
            if (isName)
                text_ += ' ';
            else
                line(level + 1);
            putField(place, field, value, level + 1);
        }
        const bool hasChildren = node && putChildren(*node, level + 1);
        if (!hasChildren && fitsInLine(begin, level)) return;
        line(level);
        text_ += "}";
    }

    /// Makes one line of what is there since `begin`, if it is short enough.
    bool fitsInLine(std::size_t begin, std::size_t level) {
        if (text_.size() - begin > 4 * kWidth) return false;
        std::string one;
        for (std::size_t i = begin; i < text_.size(); ++i) {
            one += text_[i] == '\n' ? ' ' : text_[i];
            if (text_[i] == '\n')
                while (i + 1 < text_.size() && text_[i + 1] == ' ') ++i;
        }
        one += one.ends_with('{') ? "}" : " }";
        if (indentOf(level) + one.size() > kWidth) return false;
        text_.resize(begin);
        text_ += one;
        return true;
    }

    bool putChildren(const Node& node, std::size_t level) {
        bool any = false;
        for (const ObjectId child : node.children) {
            if (scene_.get<Node>(child)->ofServer) continue;
            any = true;
            put(textform::kNode, places_.at(child), level);
        }
        return any;
    }

    // ---- fields

    void putField(std::size_t place, const SceneSchema::Field& field, const FieldValue& value, std::size_t level) {
        const std::string& word = field.descriptor->name();
        if (const auto* ref = std::get_if<ObjectId>(&value)) return putRef(place, field, *ref, level);
        if (const auto* refs = std::get_if<RefList>(&value)) return putRefs(place, field, *refs, level);
        if (const auto* blob = std::get_if<Blob>(&value)) return putArray(field, *blob, level);
        text_ += word;
        text_ += ": ";
        if (const auto* floats = std::get_if<Floats>(&value)) {
            putNumbers(std::span(floats->values).first(floats->width), level);
        } else if (const auto* doubles = std::get_if<Doubles>(&value)) {
            putNumbers(std::span(doubles->values).first(doubles->width), level);
        } else if (const auto* matrix = std::get_if<Matrix>(&value)) {
            putNumbers(std::span(matrix->values), level);
        } else if (const auto* whole = std::get_if<std::int64_t>(&value)) {
            const auto* words = field.descriptor->enum_type();
            const auto* named = words ? words->FindValueByNumber(static_cast<int>(*whole)) : nullptr;
            text_ += named ? named->name() : fmt::format("{}", *whole);
        } else if (const auto* text = std::get_if<std::string>(&value)) {
            putText(*text, level);
        } else {
            text_ += std::get<bool>(value) ? "true" : "false";
        }
    }

    template <typename T, std::size_t size>
    void putNumbers(std::span<const T, size> numbers, std::size_t level) {
        if (numbers.size() == 1)
            putNumber(numbers[0]);
        else
            putList(std::span<const T>(numbers), 1, level);
    }
    template <typename T>
    void putNumber(T number) {
        fmt::format_to(std::back_inserter(text_), "{}", number);
    }

    /// Lines are broken between elements of so many numbers.
    template <typename T>
    void putList(std::span<const T> numbers, std::size_t each, std::size_t level) {
        text_ += '[';
        for (std::size_t i = 0; i < numbers.size(); i += each) {
            const std::size_t from = text_.size();
            for (std::size_t k = i; k < std::min(i + each, numbers.size()); ++k) {
                if (k > i) text_ += ", ";
                putNumber(numbers[k]);
            }
            if (i + each < numbers.size()) text_ += ',';
            if (i > 0) breakOrSpace(from, each > 1 ? 2 : 1, level);
        }
        text_ += ']';
    }
    /// What is there since `from` goes into a line of its own if it does not fit.
    void breakOrSpace(std::size_t from, std::size_t spaces, std::size_t level) {
        if (text_.size() - lineBegin_ + spaces < kWidth) {
            text_.insert(from, spaces, ' ');
            return;
        }
        const std::string piece = text_.substr(from);
        text_.resize(from);
        line(level + 1);
        text_ += piece;
    }

    void putRef(std::size_t place, const SceneSchema::Field& field, ObjectId id, std::size_t level) {
        const std::string& word = field.descriptor->name();
        const std::size_t target = places_.at(id);
        if (held_[target].isInside && held_[target].holder == place) {
            const std::size_t begin = text_.size();
            text_ += isNode(held_[place].object) ? wordOf(target) : word;
            return putInside(target, level, begin);
        }
        text_ += word;
        text_ += ": ";
        putText(held_[target].name, level);
    }

    void putRefs(std::size_t place, const SceneSchema::Field& field, const RefList& refs, std::size_t level) {
        const std::string& word = field.descriptor->name();
        for (std::size_t i = 0; i < refs.size();) {
            if (i > 0) line(level);
            const Held& target = held_[places_.at(refs[i])];
            if (target.isInside && target.holder == place) {
                putRef(place, field, refs[i++], level);
                continue;
            }
            // Those that are named, up to the next that stands here.
            text_ += word;
            text_ += ": [";
            for (const std::size_t first = i; i < refs.size(); ++i) {
                const std::size_t at = places_.at(refs[i]);
                if (held_[at].isInside && held_[at].holder == place) break;
                if (i > first) text_ += ',';
                const std::size_t from = text_.size();
                putText(held_[at].name, level);
                if (i > first) breakOrSpace(from, 1, level);
            }
            text_ += ']';
        }
    }

    void putText(std::string_view text, std::size_t level) {
        text_ += '"';
        const bool isLong = text.size() > kWidth / 2;
        for (std::size_t i = 0; i < text.size();) {
            const std::size_t length = utf8CharacterLength(text.substr(i));
            const auto c = static_cast<unsigned char>(text[i]);
            if (c == '"' || c == '\\') {
                text_ += '\\', text_ += text[i];
            } else if (c == '\n') {
                text_ += "\\n";
                // A line of a program or a letter is one here.
                if (isLong && i + 1 < text.size()) text_ += '"', line(level + 1), text_ += '"';
            } else if (c == '\t') {
                text_ += "\\t";
            } else if (c < ' ' || c == 0x7f || length == 0) {
                text_ += fmt::format("\\{:03o}", c);
            } else {
                text_ += text.substr(i, length);
            }
            i += std::max<std::size_t>(length, 1);
        }
        text_ += '"';
    }

    // ---- arrays

    void putArray(const SceneSchema::Field& field, const Blob& blob, std::size_t level) {
        const std::string& word = field.descriptor->name();
        const Elements elements = textform::elementsOf(*field.entry);
        const std::size_t bytes = blob.sizeBytes();
        Use& use = uses_.at(blob.id());
        text_ += word;
        const bool isWhole = elements.kind != Elements::Kind::kNone && bytes % elements.numberBytes == 0;
        if (isWhole && bytes / elements.numberBytes <= kMostNumbers &&
            bytes / elements.numberBytes * use.times <= kMostSaid && putElements(elements, blob, level))
            return;
        const std::string_view text = asText(blob.bytes());
        if (elements.kind == Elements::Kind::kNone && bytes * use.times <= kMostTextBytes &&
            (bytes <= kMostBytes || isPlainText(text))) {
            text_ += ": ";
            return putText(text, level);
        }
        if (use.number == 0) {
            arrays_.push_back(blob);
            use.number = static_cast<std::uint32_t>(arrays_.size());
        }
        text_ += fmt::format(" {{ array: {} }}", use.number);
    }

    bool putElements(const Elements& elements, const Blob& blob, std::size_t level) {
        const auto of = [&]<typename T>(T) {
            std::vector<T> numbers(blob.sizeBytes() / sizeof(T));
            if (!numbers.empty()) std::memcpy(numbers.data(), blob.bytes().data(), blob.sizeBytes());
            if constexpr (std::is_floating_point_v<T>)
                // Of what is no number the bits count, and a text has none.
                if (std::any_of(numbers.begin(), numbers.end(), [](T number) { return !std::isfinite(number); }))
                    return false;
            text_ += ": ";
            putList(std::span<const T>(numbers), elements.each, level);
            return true;
        };
        return textform::withNumber(elements.kind, of, false);
    }

    const SceneSchema& schema_ = SceneSchema::get();
    const Aspect& scene_;
    std::vector<Held> held_;
    std::unordered_map<ObjectId, std::uint32_t> places_;
    std::unordered_map<BlobId, Use> uses_;
    std::vector<std::size_t> shared_;
    bool rootIsSaid_ = false;
    std::string text_;
    std::size_t lineBegin_ = 0;
    std::vector<Blob> arrays_;
};

std::string headOf(std::string_view where) {
    return fmt::format(
        "# A scene that Tessera {} saved, to be read and edited.{}\n"
        "# WRITING.md (\"Saved scenes\") tells how; tessera-check --schema what each word means.\n",
        kVersion, where);
}

bool isPlainByte(unsigned char c) {
    return c >= ' ' && c < 0x7f && c != '"' && c != '\\';
}
std::size_t escapedBytes(ByteSpan bytes) {
    std::size_t plain = 0;
    for (const std::byte byte : bytes) plain += isPlainByte(static_cast<unsigned char>(byte)) ? 1 : 0;
    return bytes.size() * 4 - plain * 3;
}
void addBytes(std::string& file, ByteSpan bytes) {
    for (const std::byte byte : bytes) {
        const auto c = static_cast<unsigned char>(byte);
        if (isPlainByte(c))
            file += static_cast<char>(c);
        else
            for (const int part : {int{'\\'}, '0' + (c >> 6), '0' + (c >> 3 & 7), '0' + (c & 7)})
                file += static_cast<char>(part);
    }
}

}  // namespace

tl::unexpected<Error> sceneTooLarge() {
    return fail(ErrorCode::kLimit, "the scene is larger than the 2 GiB that a scene file can hold");
}

ObjectsToSave objectsToSave(const Aspect& scene) {
    ObjectsToSave objects;
    std::vector<ObjectId> open = {kRootNode}, next;
    while (!open.empty()) {
        const ObjectId id = open.back();
        open.pop_back();
        if (!objects.places.try_emplace(id, static_cast<std::uint32_t>(objects.order.size())).second) continue;
        objects.order.push_back(id);
        const Object object = scene.find(id);
        next.clear();
        if (object.info().refers) forEachRef(object, [&](ObjectId target) { next.push_back(target); });
        if (const Node* node = object.as<Node>())
            for (const ObjectId child : node->children)
                if (!scene.get<Node>(child)->ofServer) next.push_back(child);
        open.insert(open.end(), next.rbegin(), next.rend());
    }
    return objects;
}

Expected<WrittenText> writeNested(const Aspect& scene) {
    return NestedWriter(scene).write();
}

Expected<std::string> textWithArrays(const WrittenText& text) {
    std::size_t total = text.inside.size() + 1024;
    for (const Blob& array : text.arrays) total += escapedBytes(array.bytes()) + 16;
    if (total > kMaxSceneFileBytes) return sceneTooLarge();
    std::string file = headOf(text.arrays.empty() ? "" : " Its large arrays are at the end.");
    file.reserve(total);
    file += "saved {";
    file += text.inside;
    for (const Blob& array : text.arrays) {
        file += "\n  array: \"";
        addBytes(file, array.bytes());
        file += '"';
    }
    return file += "\n}\n";
}

Expected<std::string> textBesideArrays(const WrittenText& text, const std::string& file, const std::string& id) {
    if (text.inside.size() + 1024 > kMaxSceneFileBytes) return sceneTooLarge();
    std::string whole = headOf(" Its large arrays lie beside it.");
    whole += fmt::format("saved {{\n  arrays {{ file: \"{}\" id: \"{}\" }}", file, id);
    whole += text.inside;
    return whole += "\n}\n";
}

}  // namespace tessera
