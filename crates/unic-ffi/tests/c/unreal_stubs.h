/* As much of Unreal's types as the example of docs/engines/unreal.md names, so that it compiles. None of
 * them does anything. */
#pragma once
#include <cstdint>
#include <initializer_list>

using int32 = std::int32_t;
using uint32 = std::uint32_t;
constexpr int32 INDEX_NONE = -1;
#define TEXT(text) text
#define TCHAR_TO_UTF8(text) (text)
#define UTF8_TO_TCHAR(text) (text)
enum ELogVerbosity { Error };
constexpr int LogTemp = 0;
template <typename... Words>
void Log(int, ELogVerbosity, const char*, Words...) {}
#define UE_LOG(category, verbosity, ...) Log(category, verbosity, __VA_ARGS__)

struct FString { const char* operator*() const { return ""; } };
struct FName { explicit FName(const char*) {} };

template <typename T>
struct TArray {
    TArray() = default;
    TArray(std::initializer_list<T>) {}
    template <typename Other>
    explicit TArray(const TArray<Other>& other) { for (const Other& value : other) Add(T(value)); }
    void Add(T) {}
    bool Contains(const T&) const { return false; }
    int32 Find(const T&) const { return INDEX_NONE; }
    void SetNum(int32) {}
    int32 Num() const { return 0; }
    T* GetData() { return nullptr; }
    T& operator[](int32) { return *begin(); }
    const T& operator[](int32) const { return *begin(); }
    T* begin() const { return nullptr; }
    T* end() const { return nullptr; }
};

struct FVector { double X, Y, Z; explicit FVector(struct FVector3f); FVector() = default; };
struct FVector3f { float X, Y, Z; explicit FVector3f(FVector) {} FVector3f() = default; };
inline FVector::FVector(FVector3f) {}
struct FQuat { double X, Y, Z, W; };
struct FMatrix44f { float M[4][4]; };
struct FQuat4f {
    float X, Y, Z, W;
    explicit FQuat4f(FQuat) {}
    explicit FQuat4f(FMatrix44f) {}
    FQuat4f operator*(FQuat4f other) const { return other; }
    FQuat4f GetNormalized() const { return *this; }
};
struct FTransform {
    FQuat GetRotation() const { return {}; }
    FVector GetLocation() const { return {}; }
};

struct USkeletalMesh { const TArray<FMatrix44f>& GetRefBasesInvMatrix() const { return matrices; } TArray<FMatrix44f> matrices; };
struct USkeletalMeshComponent {
    int32 GetBoneIndex(FName) const { return INDEX_NONE; }
    FTransform GetBoneTransform(int32) const { return {}; }
    USkeletalMesh* GetSkeletalMeshAsset() const { return nullptr; }
};

namespace EEndPlayReason { enum Type { Destroyed }; }
enum ELevelTick { LEVELTICK_All };
struct FActorComponentTickFunction { bool bCanEverTick; };
struct FLinearColor {};
struct FVector2D {};
struct FProcMeshTangent {};
class UProceduralMeshComponent {
public:
    using Super = UProceduralMeshComponent;
    virtual ~UProceduralMeshComponent() = default;
    FActorComponentTickFunction PrimaryComponentTick;
    void AddTickPrerequisiteComponent(USkeletalMeshComponent*) {}
    void SetAbsolute(bool, bool, bool) {}
    int32 GetNumSections() const { return 0; }
    virtual void BeginPlay() {}
    virtual void EndPlay(const EEndPlayReason::Type) {}
    virtual void TickComponent(float, ELevelTick, FActorComponentTickFunction*) {}
    void CreateMeshSection(int32, const TArray<FVector>&, const TArray<int32>&, const TArray<FVector>&, const TArray<FVector2D>&,
                           const TArray<FLinearColor>&, const TArray<FProcMeshTangent>&, bool) {}
    void UpdateMeshSection(int32, const TArray<FVector>&, const TArray<FVector>&, const TArray<FVector2D>&,
                           const TArray<FLinearColor>&, const TArray<FProcMeshTangent>&) {}
};
