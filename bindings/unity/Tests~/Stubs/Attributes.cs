// Attributes that say something to the editor alone, and two that the stubs follow.

using System;

namespace UnityEngine
{
    public sealed class SerializeField : Attribute { }
    public sealed class HideInInspector : Attribute { }
    public sealed class DisallowMultipleComponent : Attribute { }
    public sealed class TooltipAttribute : Attribute { public TooltipAttribute(string text) { } }
    public sealed class RangeAttribute : Attribute { public RangeAttribute(float min, float max) { } }
    public sealed class AddComponentMenu : Attribute { public AddComponentMenu(string menu) { } }

    public sealed class DefaultExecutionOrder : Attribute
    {
        public readonly int order;
        public DefaultExecutionOrder(int order) { this.order = order; }
    }

    public sealed class RequireComponent : Attribute
    {
        public readonly Type[] types;
        public RequireComponent(Type a) { types = new[] { a }; }
        public RequireComponent(Type a, Type b) { types = new[] { a, b }; }
    }
}
