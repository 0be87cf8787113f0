/// The messages of scene files, made from the table of types when a program first needs them. Internal to whoever reads
/// and writes these files.
#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/dynamic_message.h>

#include <memory>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/scene/FieldTable.h"

namespace tessera {

/// Immutable and shared by all threads.
class SceneSchema {
public:
    struct Field {
        const FieldEntry* entry = nullptr;
        const google::protobuf::FieldDescriptor* descriptor = nullptr;
    };
    struct Type {
        const TypeInfo* info = nullptr;
        const google::protobuf::FieldDescriptor* inObject = nullptr;  ///< the message of this type
        std::vector<Field> fields;
    };
    /// The number of a type's field in Object.
    static constexpr int kFirstType = 100;
    // Object's own fields, and those of Saved.
    static constexpr int kNumber = 1, kChild = 2, kLater = 3, kLaterFields = 4, kAt = 5;
    static constexpr int kObject = 1, kRoot = 2, kLaterSaved = 3, kLaterFile = 4, kNamed = 5;

    [[nodiscard]] static const SceneSchema& get();

    [[nodiscard]] const google::protobuf::Descriptor& file() const { return *file_; }
    [[nodiscard]] const google::protobuf::Descriptor& object() const { return *object_; }
    [[nodiscard]] const google::protobuf::DescriptorPool& pool() const { return pool_; }
    [[nodiscard]] const google::protobuf::FieldDescriptor& objectField(int number) const {
        return *object_->FindFieldByNumber(number);
    }
    /// In the order of allTypes().
    [[nodiscard]] std::span<const Type> types() const { return types_; }
    /// By the number of its field in Object; null where this version does not know it.
    [[nodiscard]] const Type* findType(int number) const;
    [[nodiscard]] std::unique_ptr<google::protobuf::Message> newMessage(const google::protobuf::Descriptor& type) const;
    /// What this schema has for a field of proto/scene.proto's own classes.
    [[nodiscard]] const google::protobuf::FieldDescriptor* twin(
        const google::protobuf::FieldDescriptor* generated) const;
    [[nodiscard]] std::string text() const;

private:
    SceneSchema();

    google::protobuf::DescriptorPool pool_;
    mutable google::protobuf::DynamicMessageFactory messages_{&pool_};
    const google::protobuf::Descriptor* file_ = nullptr;
    const google::protobuf::Descriptor* object_ = nullptr;
    std::vector<Type> types_;
    std::unordered_map<int, const Type*> byNumber_;
    std::unordered_map<const google::protobuf::FieldDescriptor*, const google::protobuf::FieldDescriptor*> twins_;
};

}  // namespace tessera
