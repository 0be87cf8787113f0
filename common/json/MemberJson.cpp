#include "common/json/MemberJson.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>

#include "common/json/ChangeJson.h"
#include "common/request/Check.h"

namespace tessera {
namespace {

// ---- writing

class MemberJsonWriter {
public:
    explicit MemberJsonWriter(Binaries& binaries) : binaries_(binaries) {}

    void put(Json& json, const Description& of, const void* value) {
        for (const MemberEntry& m : of.members)
            if (m.form != MemberForm::kReserved && m.form != MemberForm::kRest && of.calledFor(m, value))
                putMember(json, m, m.in(value));
    }

private:
    void putMember(Json& json, const MemberEntry& m, const void* member) {
        if (m.form == MemberForm::kSpread) return put(json, *m.held.described, member);
        if (m.manner == Manner::kOptional && m.count(member) == 0) return;
        Json& said = json[std::string(m.name)];
        if (m.manner == Manner::kMany) {
            said = Json::array();
            for (std::size_t i = 0; i < m.count(member); ++i) said.push_back(one(m, m.held, m.at(member, i)));
            return;
        }
        const void* const value = m.at(member, 0);
        if (m.form == MemberForm::kNumbers) {
            const auto* const numbers = static_cast<const double*>(value);
            said = numbers[0];
            json[std::string(m.second)] = numbers[1];
        } else if (m.form == MemberForm::kFixed) {
            said = fmt::format("{:016x}", integerOf(m.held, value));
        } else {
            said = one(m, m.held, value);
        }
    }
    [[nodiscard]] Json one(const MemberEntry& m, const ValueType& type, const void* value) {
        const auto* const numbers = static_cast<const double*>(value);
        switch (type.kind) {
            case ValueKind::kBool:
                return *static_cast<const bool*>(value);
            case ValueKind::kWord:
                return type.words[integerOf(type, value)];
            case ValueKind::kUnsigned:
                return unsignedJson(type, integerOf(type, value));
            case ValueKind::kSigned:
                return static_cast<std::int64_t>(integerOf(type, value));
            case ValueKind::kNumber:
                return *numbers;
            case ValueKind::kText:
                return *static_cast<const std::string*>(value);
            case ValueKind::kPlace:
                return Json::array({numbers[0], numbers[1]});
            case ValueKind::kVector:
                return Json::array({numbers[0], numbers[1], numbers[2]});
            // Eigen keeps w behind the others.
            case ValueKind::kRotation:
                return Json::array({numbers[3], numbers[0], numbers[1], numbers[2]});
            case ValueKind::kBytes: {
                const auto& bytes = *static_cast<const ByteSlice*>(value);
                return m.holds == Holds::kChanges ? changesJson(bytes) : binaryJson(bytes, binaries_);
            }
            case ValueKind::kRow: {
                Json row = Json::array();
                for (std::size_t at = 0; at < type.bytes; at += type.each->bytes)
                    row.push_back(one(m, *type.each, static_cast<const std::byte*>(value) + at));
                return row;
            }
            case ValueKind::kValue: {
                Json json = Json::object();
                put(json, *type.described, value);
                return json;
            }
        }
        return {};
    }
    [[nodiscard]] static Json unsignedJson(const ValueType& type, std::uint64_t number) {
        if (type.id == IdKind::kObject) return jsonOf(ObjectId(number));
        if (type.id == IdKind::kObjectType) return jsonOf(ObjectType(static_cast<std::uint16_t>(number)));
        return number;
    }

    Binaries& binaries_;
};

// ---- reading

bool isSaid(const MemberEntry& m) {
    return m.form != MemberForm::kReserved && m.form != MemberForm::kRest;
}

void addNames(std::vector<std::string_view>& names, const Description& of);
void addNames(std::vector<std::string_view>& names, const MemberEntry& m) {
    if (m.form == MemberForm::kSpread) return addNames(names, *m.held.described);
    if (!isSaid(m)) return;
    names.push_back(m.name);
    if (m.form == MemberForm::kNumbers) names.push_back(m.second);
}
void addNames(std::vector<std::string_view>& names, const Description& of) {
    for (const MemberEntry& m : of.members) addNames(names, m);
}
template <typename Of>
std::vector<std::string_view> namesOf(const Of& of) {
    std::vector<std::string_view> names;
    addNames(names, of);
    return names;
}

}  // namespace

Json memberJson(const Description& of, const void* value, Binaries& binaries) {
    Json json = Json::object();
    MemberJsonWriter(binaries).put(json, of, value);
    return json;
}

void MemberJsonReader::take(const Description& of, void* value, const Json& json) {
    if (!json.is_object()) return place_.refuseType("an object", json);
    for (const auto& [key, held] : json.items()) {
        if (!place_.sound()) return;
        if (!takeMember(of, value, key, held)) noSuchMember(of, key);
    }
    if (place_.sound()) refuseUncalledFor(of, value, json);
}

void MemberJsonReader::check(const Description& of, const void* value) {
    if (!place_.sound()) return;
    std::optional<Error> wrong = findFault(of, value);
    if (!wrong) return;
    // It begins with the member's name, or its path.
    const std::string_view path = std::string_view(wrong->message).substr(0, wrong->message.find_first_of(" :"));
    const std::vector<std::string_view> names = namesOf(of);
    if (std::ranges::find(names, path.substr(0, path.find('.'))) != names.end()) {
        const JsonPlace::Step step(place_, path);
        place_.refuse(wrong->code, std::string(std::string_view(wrong->message).substr(path.size() + 1)));
    } else {
        place_.refuse(wrong->code, wrong->message);
    }
}

void MemberJsonReader::noSuchMember(const Description& of, const std::string& key) {
    const std::vector<std::string_view> names = namesOf(of);
    const JsonPlace::Step step(place_, key);
    place_.refuse(ErrorCode::kBadInput,
                  names.empty() ? "there is no such field, and there are no others"
                                : fmt::format("there is no such field; there are {}", fmt::join(names, ", ")));
}

void MemberJsonReader::refuseUncalledFor(const Description& of, const void* value, const Json& json) {
    for (const MemberEntry& m : of.members) {
        if (!place_.sound()) return;
        if (of.calledFor(m, value)) {
            if (m.form == MemberForm::kSpread) refuseUncalledFor(*m.held.described, m.in(value), json);
            continue;
        }
        for (const std::string_view name : namesOf(m)) {
            if (!json.contains(std::string(name))) continue;
            const JsonPlace::Step step(place_, name);
            return place_.refuse(ErrorCode::kBadInput, fmt::format("is said {} alone", m.whenText));
        }
    }
}

bool MemberJsonReader::takeMember(const Description& of, void* value, const std::string& key, const Json& json) {
    for (const MemberEntry& m : of.members) {
        if (m.form == MemberForm::kSpread) {
            if (takeMember(*m.held.described, m.in(value), key, json)) return true;
        } else if (isSaid(m)) {
            const bool second = m.form == MemberForm::kNumbers && key == m.second;
            if (key != m.name && !second) continue;
            const JsonPlace::Step step(place_, key);
            takeValue(m, m.in(value), json, second);
            return true;
        }
    }
    return false;
}

void MemberJsonReader::takeValue(const MemberEntry& m, void* member, const Json& json, bool second) {
    if (m.manner == Manner::kMany) return takeMany(m, member, json);
    if (m.manner == Manner::kOptional && json.is_null()) return m.holder.resize(member, 0);
    void* const value = m.add(member);
    if (m.form == MemberForm::kNumbers) {
        if (const std::optional<double> number = numberIn(place_, json))
            static_cast<double*>(value)[second ? 1 : 0] = *number;
    } else if (m.form == MemberForm::kFixed) {
        if (const std::optional<std::uint64_t> number = hexIn(place_, json)) setInteger(m.held, value, *number);
    } else {
        takeOne(m, m.held, value, json);
    }
}

void MemberJsonReader::takeMany(const MemberEntry& m, void* values, const Json& json) {
    if (!json.is_array()) return place_.refuseType("an array", json);
    if (m.most != nullptr && json.size() > ApplicationLimits{}.*m.most)
        return place_.refuse(ErrorCode::kLimit, fmt::format("{} entries; at most {} are allowed", json.size(),
                                                            ApplicationLimits{}.*m.most));
    m.holder.resize(values, 0);
    for (std::size_t i = 0; i < json.size() && place_.sound(); ++i) {
        const JsonPlace::Step step(place_, i);
        takeOne(m, m.held, m.add(values), json[i]);
    }
}

void MemberJsonReader::takeOne(const MemberEntry& m, const ValueType& type, void* value, const Json& json) {
    auto* const numbers = static_cast<double*>(value);
    switch (type.kind) {
        case ValueKind::kBool:
            if (!json.is_boolean()) return place_.refuseType("true or false", json);
            *static_cast<bool*>(value) = json.get<bool>();
            return;
        case ValueKind::kWord:
            return takeWord(type, value, json);
        case ValueKind::kUnsigned:
        case ValueKind::kSigned:
            return takeInteger(m, type, value, json);
        case ValueKind::kNumber:
            if (const std::optional<double> number = numberIn(place_, json)) *numbers = *number;
            return;
        case ValueKind::kText:
            if (!json.is_string()) return place_.refuseType("a text", json);
            *static_cast<std::string*>(value) = json.get<std::string>();
            return;
        case ValueKind::kPlace:
        case ValueKind::kVector:
            numbersIn(place_, json, type.bytes / sizeof(double),
                      [&](std::size_t i, double number) { numbers[i] = number; });
            return;
        case ValueKind::kRotation:
            // Eigen keeps w behind the others.
            numbersIn(place_, json, 4, [&](std::size_t i, double number) { numbers[(i + 3) % 4] = number; });
            return;
        case ValueKind::kRow:
            return takeRow(m, type, value, json);
        case ValueKind::kBytes:
            return takeBytes(m, *static_cast<ByteSlice*>(value), json);
        case ValueKind::kValue:
            return take(*type.described, value, json);
    }
}

void MemberJsonReader::takeInteger(const MemberEntry& m, const ValueType& type, void* value, const Json& json) {
    const unsigned unused = 64 - static_cast<unsigned>(8 * type.bytes);
    std::optional<std::uint64_t> number;
    if (type.id == IdKind::kObject) {
        if (const std::optional<ObjectId> object = objectIn(place_, json, around_.named)) number = object->value;
    } else if (type.id == IdKind::kObjectType) {
        if (const std::optional<ObjectType> named = typeIn(place_, json)) number = named->value;
    } else if (type.kind == ValueKind::kSigned) {
        const std::int64_t most = std::numeric_limits<std::int64_t>::max() >> unused;
        if (const std::optional<std::int64_t> whole = signedIn(place_, json, -most - 1, most))
            number = static_cast<std::uint64_t>(*whole);
    } else if (m.around && json.is_number_integer() && !json.is_number_unsigned()) {
        // JavaScript has no whole numbers near 2^64, where the way back from 0 begins.
        number = static_cast<std::uint64_t>(json.get<std::int64_t>()) << unused >> unused;
    } else {
        number = unsignedIn(place_, json, std::numeric_limits<std::uint64_t>::max() >> unused);
    }
    if (number) setInteger(type, value, *number);
}

void MemberJsonReader::takeWord(const ValueType& type, void* value, const Json& json) {
    if (!json.is_string())
        return place_.refuseType(fmt::format("one of the words {}", fmt::join(type.words, ", ")), json);
    const auto& said = json.get_ref<const std::string&>();
    const auto word = std::ranges::find(type.words, std::string_view(said));
    if (word == type.words.end())
        return place_.refuse(ErrorCode::kBadInput,
                             fmt::format("\"{}\" is none of {}", shortened(said), fmt::join(type.words, ", ")));
    setInteger(type, value, static_cast<std::uint64_t>(word - type.words.begin()));
}

void MemberJsonReader::takeRow(const MemberEntry& m, const ValueType& type, void* value, const Json& json) {
    const std::size_t count = type.bytes / type.each->bytes;
    if (!json.is_array() || json.size() != count) return place_.refuseType(fmt::format("an array of {}", count), json);
    for (std::size_t i = 0; i < count && place_.sound(); ++i) {
        const JsonPlace::Step step(place_, i);
        takeOne(m, *type.each, static_cast<std::byte*>(value) + i * type.each->bytes, json[i]);
    }
}

void MemberJsonReader::takeBytes(const MemberEntry& m, ByteSlice& value, const Json& json) {
    if (json.is_null())
        value = {};
    else if (m.holds == Holds::kChanges)
        value = changesIn(place_, json, around_.binaries, around_.named, around_.arrays);
    else if (const std::optional<ByteSlice> bytes = binaryIn(place_, json, around_.binaries))
        value = *bytes;
}

}  // namespace tessera
