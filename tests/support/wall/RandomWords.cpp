#include "tests/support/wall/RandomWords.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "common/codec/ChangeCodec.h"
#include "common/request/Said.h"

namespace tessera::simulation {

RandomWords::RandomWords(Random& random, const Aspect& scene, RandomWordsOptions options)
    : random_(random), scene_(scene), options_(std::move(options)) {
    for (const ObjectId id : scene.ids()) {
        if (options_.untouched.contains(id)) continue;
        all_.push_back(id);
        if (scene.find(id).as<Node>()) nodes_.push_back(id);
    }
}

bool RandomWords::mayBeIn(const TypeInfo& type) const {
    return !options_.still || !(type.effects & (Effect::kTime | Effect::kRules | Effect::kTerms));
}

ApplicationRequest RandomWords::request() {
    const auto kinds = kindsOf<ApplicationRequest>();
    const SaidKind<ApplicationRequest>& kind = kinds[random_.below(kinds.size())];
    ApplicationRequest made;
    fill(*kind.description, kind.make(made));
    if (auto* proposal = std::get_if<request::ProposeChanges>(&made))
        if (!wild()) proposal->list = ByteSlice(encodeChangeList(list()));
    return made;
}

void RandomWords::fill(const Description& of, void* value) {
    for (const MemberEntry& m : of.members) {
        void* const member = m.in(value);
        if (m.form == MemberForm::kSpread) {
            fill(*m.held.described, member);
        } else if (m.form != MemberForm::kReserved && m.form != MemberForm::kRest && of.calledFor(m, value)) {
            if (m.manner == Manner::kOne) {
                one(m, m.held, member);
                continue;
            }
            m.holder.resize(member, 0);
            const std::uint64_t count =
                m.manner == Manner::kMany ? random_.below(4) : std::uint64_t{random_.below(2) == 0};
            for (std::uint64_t i = 0; i < count; ++i) one(m, m.held, m.add(member));
        }
    }
}

void RandomWords::one(const MemberEntry& m, const ValueType& type, void* value) {
    switch (type.kind) {
        case ValueKind::kBool:
            setInteger(type, value, random_.below(2) == 0 ? 1 : 0);
            return;
        case ValueKind::kWord: {
            const std::uint64_t word = random_.below(type.words.size() + (wild() ? 2 : 0));
            std::memcpy(value, &word, type.bytes);  // it may be none
            return;
        }
        case ValueKind::kUnsigned:
        case ValueKind::kSigned: {
            std::uint64_t number = 0;
            if (type.id == IdKind::kObject)
                number = wild() ? random_.below(1 << 16) : anyNode().value;
            else if (type.id == IdKind::kObjectType)
                number = allTypes()[random_.below(allTypes().size())].type.value;
            else if (type.id == IdKind::kOther)
                number = random_.below(64);
            else
                number = wild() ? random_.next() : random_.below(20);
            if (type.id == IdKind::kObject && options_.untouched.contains(ObjectId(number))) number = 0;
            std::memcpy(value, &number, type.bytes);
            return;
        }
        case ValueKind::kText:
            *static_cast<std::string*>(value) = text();
            return;
        case ValueKind::kNumber:
        case ValueKind::kPlace:
        case ValueKind::kVector:
            for (std::size_t i = 0; i < type.bytes / sizeof(double); ++i)
                static_cast<double*>(value)[i] = number(m.bounds.least, m.bounds.greatest);
            return;
        case ValueKind::kRotation: {
            const double w = number(-1, 1), x = number(-1, 1), y = number(-1, 1);
            *static_cast<Quatd*>(value) = Quatd(w, x, y, number(-1, 1));
            return;
        }
        case ValueKind::kRow:
            for (std::size_t at = 0; at < type.bytes; at += type.each->bytes)
                one(m, *type.each, static_cast<std::byte*>(value) + at);
            return;
        case ValueKind::kBytes: {
            Bytes bytes(random_.below(200));
            for (std::byte& each : bytes) each = static_cast<std::byte>(random_.next());
            *static_cast<ByteSlice*>(value) = ByteSlice(std::move(bytes));
            return;
        }
        case ValueKind::kValue:
            fill(*type.described, value);
            return;
    }
}

double RandomWords::number(double least, double greatest) {
    constexpr std::array kHard = {0.0,
                                  -0.0,
                                  1e-9,
                                  1e-160,
                                  5e-324,
                                  1e6,
                                  1e15,
                                  1e60,
                                  1e155,
                                  1e300,
                                  -1e-9,
                                  -1e6,
                                  -1e60,
                                  std::numeric_limits<double>::max(),
                                  std::numeric_limits<double>::infinity(),
                                  std::numeric_limits<double>::quiet_NaN()};
    if (wild()) return kHard[random_.below(kHard.size())];
    const double low = std::max(least, -kFar), high = std::max(low, std::min(greatest, kFar));
    switch (random_.below(6)) {
        case 0:
            return low;
        case 1:
            return high;
        default:
            break;
    }
    // Most things are some units large.
    const double part = static_cast<double>(random_.next() >> 11) * 0x1p-53;
    const double near = 4 * (2 * part - 1);
    return near >= low && near <= high ? near : low + part * (high - low);
}

std::string RandomWords::text() {
    static const std::vector<std::string> kTexts = {
        "",    "/",    "//*",          "#1",        "/no/such", "größe \"x\"\n",
        "a/b", "x[1]", "/row[1]/ball", "asset://x", "\xff\xfe", "$0"};
    switch (random_.below(4)) {
        case 0:
            return kTexts[random_.below(kTexts.size())];
        case 1:
            if (!options_.files.empty()) return options_.files[random_.below(options_.files.size())];
            [[fallthrough]];
        default:
            break;
    }
    if (wild()) return std::string(random_.below(3000), 'n');
    const ObjectId node = anyNode();
    return scene_.get<Node>(node) ? pathOf(scene_, node) : "#" + std::to_string(node.value);
}

ObjectId RandomWords::anyNode() {
    if (random_.below(8) == 0) return all_.empty() ? ObjectId{} : all_[random_.below(all_.size())];
    return nodes_.empty() ? kRootNode : nodes_[random_.below(nodes_.size())];
}

FieldValue RandomWords::other(const FieldInfo& field, FieldValue value) {
    const double least = wild() ? -kFar : field.least, greatest = wild() ? kFar : field.greatest;
    if (auto* floats = std::get_if<Floats>(&value)) {
        for (std::size_t i = 0; i < floats->width; ++i) floats->values[i] = static_cast<float>(number(least, greatest));
    } else if (auto* doubles = std::get_if<Doubles>(&value)) {
        for (std::size_t i = 0; i < doubles->width; ++i) doubles->values[i] = number(least, greatest);
    } else if (auto* integer = std::get_if<std::int64_t>(&value)) {
        *integer = wild() ? static_cast<std::int64_t>(random_.next()) : static_cast<std::int64_t>(random_.below(6));
    } else if (auto* reference = std::get_if<ObjectId>(&value)) {
        *reference = random_.below(4) == 0 || all_.empty() ? ObjectId{} : all_[random_.below(all_.size())];
    } else if (auto* words = std::get_if<std::string>(&value)) {
        *words = text();
    } else if (auto* flag = std::get_if<bool>(&value)) {
        *flag = !*flag;
    } else if (auto* references = std::get_if<RefList>(&value)) {
        if (!references->empty() && random_.below(2) == 0)
            references->pop_back();
        else
            references->push_back(anyNode());
    } else if (auto* matrix = std::get_if<Matrix>(&value)) {
        matrix->values[random_.below(16)] = number(least, greatest);
    } else if (auto* array = std::get_if<Blob>(&value)) {
        // Another one of the scene, or one whose bytes are anything.
        if (random_.below(2) == 0) *array = Blob();
    }
    return value;
}

/// Says of an object what may be true of another one: a field or a piece of an array, at any offset.
void RandomWords::foreign(ChangeListBuilder& list, ObjectId object) {
    const Object present = scene_.find(object);
    const TypeInfo& type = wild() ? allTypes()[random_.below(allTypes().size())] : present.info();
    if (type.fields.empty() || !mayBeIn(type)) return;
    const FieldEntry& field = type.fields[random_.below(type.fields.size())];
    if (field.kind == FieldKind::kBlob || wild()) {
        const std::uint64_t offset = wild() ? random_.next() : random_.below(64);
        list.setRange(object, type.type, field.id, offset, Blob(Bytes(1 + random_.below(32))));
    } else {
        list.set(object, type.type, field.id, other(field, field.load(type.freshObject())));
    }
}

ChangeList RandomWords::list() {
    ChangeListBuilder list;
    std::uint64_t made = 0;
    for (std::uint64_t changes = 1 + random_.below(4); changes > 0; --changes) {
        const ObjectId node = nodes_.empty() ? kRootNode : nodes_[random_.below(nodes_.size())];
        switch (random_.below(10)) {
            case 0: {
                const TypeInfo& type = allTypes()[random_.below(allTypes().size())];
                if (!mayBeIn(type)) break;
                const ObjectId core{kFirstPlaceholder + made++}, holder{kFirstPlaceholder + made++};
                list.create(core, type.type);
                if (!type.isCore) break;
                list.create(holder, typeOf<Node>());
                setField<&Node::core>(list, holder, core);
                list.place(holder, node);
                break;
            }
            case 1:
                list.place(node, anyNode(), static_cast<std::uint32_t>(random_.below(4)));
                break;
            case 2:
                if (random_.below(3) != 0) break;
                list.detach(node);
                list.destroy(node);
                break;
            case 3:
                if (!all_.empty()) foreign(list, all_[random_.below(all_.size())]);
                break;
            default: {
                if (all_.empty()) break;
                const ObjectId id = all_[random_.below(all_.size())];
                const Object object = scene_.find(id);
                if (!object || object.info().fields.empty()) break;
                const FieldEntry& field = object.info().fields[random_.below(object.info().fields.size())];
                list.set(id, object.info().type, field.id, other(field, field.load(object)));
            }
        }
    }
    return list.take();
}

}  // namespace tessera::simulation
