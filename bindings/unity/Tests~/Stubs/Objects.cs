// Objects, components, and a scene that calls them as Unity does.

using System;
using System.Collections.Generic;
using System.Linq;
using System.Reflection;

namespace UnityEngine
{
    [Flags]
    public enum HideFlags { None = 0, DontSave = 52 }

    public class Object
    {
        internal bool isDestroyed;
        public string name { get; set; } = "";
        public HideFlags hideFlags { get; set; }

        public static void Destroy(Object o) { DestroyImmediate(o); }
        public static void DestroyImmediate(Object o)
        {
            if (o == null) return;
            o.OnDestroyed();
            o.isDestroyed = true;
        }
        internal virtual void OnDestroyed() { }

        // A destroyed object equals null.
        public static bool operator ==(Object a, Object b)
        {
            bool aIsNull = ReferenceEquals(a, null) || a.isDestroyed, bIsNull = ReferenceEquals(b, null) || b.isDestroyed;
            return aIsNull || bIsNull ? aIsNull && bIsNull : ReferenceEquals(a, b);
        }
        public static bool operator !=(Object a, Object b) { return !(a == b); }
        public static implicit operator bool(Object o) { return o != null; }
        public override bool Equals(object other) { return this == other as Object; }
        public override int GetHashCode() { return base.GetHashCode(); }
    }

    public class ScriptableObject : Object
    {
        public static T CreateInstance<T>() where T : ScriptableObject, new()
        {
            T made = new T();
            Scene.Message(made, "OnEnable");
            return made;
        }
        internal override void OnDestroyed() { Scene.Message(this, "OnDisable"); }
    }

    public class GameObject : Object
    {
        private readonly List<Component> components = new List<Component>();
        private bool self = true;

        public GameObject(string name = "")
        {
            this.name = name;
            transform = new Transform { gameObject = this };
            components.Add(transform);
        }

        public Transform transform { get; private set; }
        public bool activeSelf => self;
        public bool activeInHierarchy => self && (transform.parent == null || transform.parent.gameObject.activeInHierarchy);
        public void SetActive(bool active)
        {
            self = active;
            foreach (MonoBehaviour script in GetComponentsInChildren<MonoBehaviour>()) script.Refresh();
        }

        public T AddComponent<T>() where T : Component, new()
        {
            RequireComponent required = typeof(T).GetCustomAttribute<RequireComponent>();
            if (required != null)
                foreach (Type type in required.types)
                    if (!components.Any(type.IsInstanceOfType)) Add((Component)Activator.CreateInstance(type));
            return (T)Add(new T());
        }

        public T GetComponent<T>() where T : class { return components.OfType<T>().FirstOrDefault(); }

        public T GetComponentInChildren<T>() where T : class { return GetComponentsInChildren<T>().FirstOrDefault(); }

        public T[] GetComponentsInChildren<T>() where T : class
        {
            IEnumerable<T> own = components.OfType<T>();
            return own.Concat(transform.Children.SelectMany(c => c.gameObject.GetComponentsInChildren<T>())).ToArray();
        }

        private Component Add(Component component)
        {
            component.gameObject = this;
            components.Add(component);
            MonoBehaviour script = component as MonoBehaviour;
            if (script != null) Scene.Add(script);
            return component;
        }

        internal override void OnDestroyed()
        {
            foreach (Transform child in transform.Children.ToArray()) DestroyImmediate(child.gameObject);
            foreach (Component component in components) DestroyImmediate(component);
            transform.SetParent(null);
        }
    }

    public class Component : Object
    {
        public GameObject gameObject { get; internal set; }
        public Transform transform => gameObject.transform;
        public new string name { get { return gameObject.name; } set { gameObject.name = value; } }
        public T GetComponent<T>() where T : class { return gameObject.GetComponent<T>(); }
        public T[] GetComponentsInChildren<T>() where T : class { return gameObject.GetComponentsInChildren<T>(); }
    }

    public class Behaviour : Component
    {
        private bool isOn = true;
        public bool enabled
        {
            get { return isOn; }
            set { isOn = value; Refresh(); }
        }
        public bool isActiveAndEnabled => isOn && gameObject.activeInHierarchy && !isDestroyed;
        internal virtual void Refresh() { }
    }

    public class MonoBehaviour : Behaviour
    {
        private bool wasOn;
        internal bool hasStarted;
        internal Action update, lateUpdate;
        internal override void Refresh()
        {
            if (isActiveAndEnabled == wasOn) return;
            wasOn = isActiveAndEnabled;
            Scene.Message(this, wasOn ? "OnEnable" : "OnDisable");
        }
        internal override void OnDestroyed()
        {
            if (wasOn) Scene.Message(this, "OnDisable");
            wasOn = false;
            Scene.Message(this, "OnDestroy");
            Scene.Remove(this);
        }
    }

    public class Transform : Component
    {
        internal readonly List<Transform> Children = new List<Transform>();
        public Transform parent { get; private set; }
        public Vector3 localPosition { get; set; }
        public Quaternion localRotation { get; set; } = Quaternion.identity;
        public Vector3 localScale { get; set; } = Vector3.one;
        public int childCount => Children.Count;
        public Transform GetChild(int i) { return Children[i]; }

        // Keeps the place in the parent; the package sets local values afterwards.
        public void SetParent(Transform to, bool worldPositionStays = true)
        {
            Vector3 p = position;
            Quaternion q = rotation;
            if (parent != null) parent.Children.Remove(this);
            parent = to;
            if (to != null) to.Children.Add(this);
            if (worldPositionStays) SetPositionAndRotation(p, q);
        }

        public bool IsChildOf(Transform other)
        {
            for (Transform t = this; t != null; t = t.parent) if (t == other) return true;
            return false;
        }

        public Matrix4x4 localToWorldMatrix
        {
            get
            {
                Matrix4x4 own = Matrix4x4.TRS(localPosition, localRotation, localScale);
                return parent == null ? own : parent.localToWorldMatrix * own;
            }
        }
        public Matrix4x4 worldToLocalMatrix => localToWorldMatrix.inverse;

        public Vector3 position
        {
            get { return parent == null ? localPosition : parent.TransformPoint(localPosition); }
            set { localPosition = parent == null ? value : parent.worldToLocalMatrix.MultiplyPoint3x4(value); }
        }
        public Quaternion rotation
        {
            get { return parent == null ? localRotation : parent.rotation * localRotation; }
            set { localRotation = parent == null ? value : Quaternion.Inverse(parent.rotation) * value; }
        }
        public Vector3 lossyScale => parent == null ? localScale : Vector3.Scale(parent.lossyScale, localScale);
        public void SetPositionAndRotation(Vector3 p, Quaternion q) { position = p; rotation = q; }
        public Vector3 TransformPoint(Vector3 p) { return localToWorldMatrix.MultiplyPoint3x4(p); }
    }

    /// <summary>All scripts, in the order of their execution.</summary>
    public static class Scene
    {
        private static readonly List<MonoBehaviour> scripts = new List<MonoBehaviour>();
        private static readonly List<MonoBehaviour> running = new List<MonoBehaviour>();

        internal static void Add(MonoBehaviour script)
        {
            script.update = Method(script, "Update");
            script.lateUpdate = Method(script, "LateUpdate");
            scripts.Add(script);
            scripts.Sort((a, b) => Order(a).CompareTo(Order(b)));
            Message(script, "Awake");
            script.Refresh();
        }

        internal static void Remove(MonoBehaviour script) { scripts.Remove(script); }

        private static int Order(MonoBehaviour script)
        {
            DefaultExecutionOrder order = script.GetType().GetCustomAttribute<DefaultExecutionOrder>();
            return order == null ? 0 : order.order;
        }

        private static Action Method(object target, string name)
        {
            MethodInfo method = Find(target, name);
            return method == null ? null : (Action)Delegate.CreateDelegate(typeof(Action), target, method);
        }

        private static MethodInfo Find(object target, string name)
        {
            return target.GetType().GetMethod(name, BindingFlags.Instance | BindingFlags.Public | BindingFlags.NonPublic,
                null, Type.EmptyTypes, null);
        }

        public static void Message(object target, string name)
        {
            Action method = Method(target, name);
            if (method != null) method();
        }

        /// <summary>Runs a frame of some seconds: Start, Update, LateUpdate.</summary>
        public static void Frame(float seconds)
        {
            Time.deltaTime = seconds;
            Time.time += seconds;
            Time.frameCount++;
            running.Clear();
            running.AddRange(scripts);
            for (int i = 0; i < running.Count; i++)
            {
                if (running[i].hasStarted || !running[i].isActiveAndEnabled) continue;
                running[i].hasStarted = true;
                Message(running[i], "Start");
            }
            for (int i = 0; i < running.Count; i++)
                if (running[i].update != null && running[i].isActiveAndEnabled) running[i].update();
            for (int i = 0; i < running.Count; i++)
                if (running[i].lateUpdate != null && running[i].isActiveAndEnabled) running[i].lateUpdate();
        }
    }

    public static class Time
    {
        public static float deltaTime { get; internal set; }
        public static float time { get; internal set; }
        public static int frameCount { get; internal set; }
    }

    public static class Application { public static bool isPlaying => true; }

    public static class Debug
    {
        public static readonly List<string> Errors = new List<string>();
        public static readonly List<string> Warnings = new List<string>();
        public static void LogWarning(object message, Object context = null) { Warnings.Add(message.ToString()); }
        public static void LogError(object message, Object context = null) { Errors.Add(message.ToString()); }
        public static void LogException(Exception exception, Object context = null) { Errors.Add(exception.Message); }
        public static void Log(object message) { Console.WriteLine(message); }
    }

    public static class Gizmos
    {
        public static readonly List<string> Drawn = new List<string>();
        public static Color color { get; set; }
        public static void DrawWireSphere(Vector3 centre, float radius) { Drawn.Add("sphere " + centre + " " + radius); }
        public static void DrawWireCube(Vector3 centre, Vector3 size) { Drawn.Add("cube " + centre); }
        public static void DrawLine(Vector3 a, Vector3 b) { Drawn.Add("line"); }
    }
}
