#include "tests/fuzz/mutate_message.h"

#include <array>
#include <cstdint>
#include <limits>
#include <string>

namespace halflight::fuzz {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::array kReals = {
    0.0,     -0.0,      1.0,        -1.0,
    0.18,    0.5,       2.0,        40.0,
    90.0,    179.0,     180.0,      1e-6,
    1e-15,   1e-38,     1e-46,      1e-300,
    5e-324,  1e7,       1e15,       1e17,
    -1e17,   1e18,      1e30,       3.4e38,
    1e39,    1e150,     -1e300,     1e308,
    1.7e308, kInfinity, -kInfinity, std::numeric_limits<double>::quiet_NaN()};
constexpr std::array<uint64_t, 20> kCounts = {
    0,   1,   2,    3,    4,     5,          8,          16,         32,          64,
    128, 512, 4096, 8192, 65536, 0x7fffffff, 0x80000000, 0xffffffff, 1ULL << 63U, ~0ULL};

template <size_t kSize, typename T>
T Pick(const std::array<T, kSize>& values, std::minstd_rand& dice) {
  return values[dice() % kSize];
}

double PickReal(double now, std::minstd_rand& dice) {
  switch (dice() % 4) {
    case 0:
      return now * 2.0;
    case 1:
      return now + std::uniform_real_distribution<double>(-2.0, 2.0)(dice);
    default:
      return Pick(kReals, dice);
  }
}

// Mostly what changes a float somewhere in a payload.
void MutateBytes(std::string& bytes, std::minstd_rand& dice) {
  const auto real = static_cast<float>(Pick(kReals, dice));
  const std::string as_bytes(reinterpret_cast<const char*>(&real), sizeof(real));
  const size_t at = bytes.empty() ? 0 : dice() % bytes.size() / sizeof(real) * sizeof(real);
  switch (dice() % 4) {
    case 0:
      bytes += as_bytes;
      break;
    case 1:
      bytes.resize(at);
      break;
    default:
      bytes.replace(at, sizeof(real), as_bytes);
      break;
  }
}

// A field that is no message: of a repeated one, the element at `index`.
class Scalar {
 public:
  Scalar(Message& message, const FieldDescriptor& field, int index)
      : message_(message), reflection_(*message.GetReflection()), field_(field), index_(index) {}

  void Mutate(std::minstd_rand& dice) {
    switch (field_.cpp_type()) {
      case FieldDescriptor::CPPTYPE_DOUBLE:
        Set(&Reflection::SetDouble, &Reflection::SetRepeatedDouble,
            PickReal(Get(&Reflection::GetDouble, &Reflection::GetRepeatedDouble), dice));
        break;
      case FieldDescriptor::CPPTYPE_FLOAT:
        Set(&Reflection::SetFloat, &Reflection::SetRepeatedFloat,
            static_cast<float>(
                PickReal(Get(&Reflection::GetFloat, &Reflection::GetRepeatedFloat), dice)));
        break;
      case FieldDescriptor::CPPTYPE_UINT32:
        Set(&Reflection::SetUInt32, &Reflection::SetRepeatedUInt32,
            static_cast<uint32_t>(Pick(kCounts, dice)));
        break;
      case FieldDescriptor::CPPTYPE_UINT64:
        Set(&Reflection::SetUInt64, &Reflection::SetRepeatedUInt64, Pick(kCounts, dice));
        break;
      case FieldDescriptor::CPPTYPE_INT32:
        Set(&Reflection::SetInt32, &Reflection::SetRepeatedInt32,
            static_cast<int32_t>(Pick(kCounts, dice)));
        break;
      case FieldDescriptor::CPPTYPE_BOOL:
        Set(&Reflection::SetBool, &Reflection::SetRepeatedBool, dice() % 2 == 0);
        break;
      case FieldDescriptor::CPPTYPE_ENUM:
        Set(&Reflection::SetEnumValue, &Reflection::SetRepeatedEnumValue,
            static_cast<int>(dice() % 10) - 1);
        break;
      case FieldDescriptor::CPPTYPE_STRING: {
        std::string bytes = Get(&Reflection::GetString, &Reflection::GetRepeatedString);
        MutateBytes(bytes, dice);
        Set(&Reflection::SetString, &Reflection::SetRepeatedString, bytes);
        break;
      }
      default:
        break;
    }
  }

 private:
  template <typename T>
  T Get(T (Reflection::*one)(const Message&, const FieldDescriptor*) const,
        T (Reflection::*element)(const Message&, const FieldDescriptor*, int) const) const {
    return field_.is_repeated() ? (reflection_.*element)(message_, &field_, index_)
                                : (reflection_.*one)(message_, &field_);
  }
  template <typename T, typename Value>
  void Set(void (Reflection::*one)(Message*, const FieldDescriptor*, T) const,
           void (Reflection::*element)(Message*, const FieldDescriptor*, int, T) const,
           const Value& value) {
    if (field_.is_repeated()) {
      (reflection_.*element)(&message_, &field_, index_, value);
    } else {
      (reflection_.*one)(&message_, &field_, value);
    }
  }

  Message& message_;
  const Reflection& reflection_;
  const FieldDescriptor& field_;
  const int index_;
};

// One more element; of scalars a zero.
void Add(Message& message, const FieldDescriptor& field) {
  const Reflection& reflection = *message.GetReflection();
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_MESSAGE:
      reflection.AddMessage(&message, &field);
      break;
    case FieldDescriptor::CPPTYPE_DOUBLE:
      reflection.AddDouble(&message, &field, 0.0);
      break;
    case FieldDescriptor::CPPTYPE_ENUM:
      reflection.AddEnumValue(&message, &field, 0);
      break;
    default:  // no message here repeats anything else
      break;
  }
}

}  // namespace

void MutateMessage(Message& message, std::minstd_rand& dice) {
  const Reflection& reflection = *message.GetReflection();
  const int fields = message.GetDescriptor()->field_count();
  if (fields == 0) {
    return;
  }
  const FieldDescriptor& field =
      *message.GetDescriptor()->field(static_cast<int>(dice() % static_cast<unsigned>(fields)));
  const bool is_message = field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
  if (!field.is_repeated()) {
    if (dice() % 8 == 0) {
      reflection.ClearField(&message, &field);
    } else if (is_message) {
      MutateMessage(*reflection.MutableMessage(&message, &field), dice);
    } else {
      Scalar(message, field, 0).Mutate(dice);
    }
    return;
  }
  if (dice() % 4 == 0) {
    Add(message, field);
  }
  const int size = reflection.FieldSize(message, &field);
  if (size == 0) {
    return;
  }
  const int index = static_cast<int>(dice() % static_cast<unsigned>(size));
  if (dice() % 8 == 0) {
    reflection.SwapElements(&message, &field, index, size - 1);
    reflection.RemoveLast(&message, &field);
  } else if (is_message) {
    MutateMessage(*reflection.MutableRepeatedMessage(&message, &field, index), dice);
  } else {
    Scalar(message, field, index).Mutate(dice);
  }
}

}  // namespace halflight::fuzz
