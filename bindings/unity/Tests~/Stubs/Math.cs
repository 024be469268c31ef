// Unity's mathematics as far as the package uses it: left-handed axes, column vectors, f32.

using System;

namespace UnityEngine
{
    public static class Mathf
    {
        public static float Sqrt(float x) { return (float)Math.Sqrt(x); }
        public static float Abs(float x) { return Math.Abs(x); }
        public static float Max(float a, float b) { return a > b ? a : b; }
        public static int Max(int a, int b) { return a > b ? a : b; }
        public static float Min(float a, float b) { return a < b ? a : b; }
        public static int Min(int a, int b) { return a < b ? a : b; }
        public static float Round(float x) { return (float)Math.Round(x); }
        public static float Sin(float x) { return (float)Math.Sin(x); }
        public static float Cos(float x) { return (float)Math.Cos(x); }
        public static float Clamp01(float x) { return x < 0f ? 0f : x > 1f ? 1f : x; }
        public static int RoundToInt(float x) { return (int)Math.Round(x); }
        public const float PI = (float)Math.PI;
        public const float Rad2Deg = 180f / PI;
    }

    public struct Vector2
    {
        public float x, y;
        public Vector2(float x, float y) { this.x = x; this.y = y; }
    }

    public struct Vector3
    {
        public float x, y, z;
        public Vector3(float x, float y, float z) { this.x = x; this.y = y; this.z = z; }
        public static Vector3 zero => new Vector3(0, 0, 0);
        public static Vector3 one => new Vector3(1, 1, 1);
        public static Vector3 up => new Vector3(0, 1, 0);
        public static Vector3 right => new Vector3(1, 0, 0);
        public static Vector3 forward => new Vector3(0, 0, 1);
        public float sqrMagnitude => x * x + y * y + z * z;
        public float magnitude => Mathf.Sqrt(sqrMagnitude);
        public Vector3 normalized => magnitude > 1e-5f ? this * (1f / magnitude) : zero;
        public static float Dot(Vector3 a, Vector3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
        public static float Distance(Vector3 a, Vector3 b) { return (a - b).magnitude; }
        public static Vector3 Cross(Vector3 a, Vector3 b)
        {
            return new Vector3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
        }
        public static Vector3 Scale(Vector3 a, Vector3 b) { return new Vector3(a.x * b.x, a.y * b.y, a.z * b.z); }
        public static Vector3 operator +(Vector3 a, Vector3 b) { return new Vector3(a.x + b.x, a.y + b.y, a.z + b.z); }
        public static Vector3 operator -(Vector3 a, Vector3 b) { return new Vector3(a.x - b.x, a.y - b.y, a.z - b.z); }
        public static Vector3 operator -(Vector3 a) { return new Vector3(-a.x, -a.y, -a.z); }
        public static Vector3 operator *(Vector3 a, float s) { return new Vector3(a.x * s, a.y * s, a.z * s); }
        public static Vector3 operator *(float s, Vector3 a) { return a * s; }
        // Unity compares with a tolerance.
        public static bool operator ==(Vector3 a, Vector3 b) { return (a - b).sqrMagnitude < 1e-10f; }
        public static bool operator !=(Vector3 a, Vector3 b) { return !(a == b); }
        public override bool Equals(object other) { return other is Vector3 && this == (Vector3)other; }
        public override int GetHashCode() { return x.GetHashCode() ^ y.GetHashCode() ^ z.GetHashCode(); }
        public override string ToString() { return "(" + x + ", " + y + ", " + z + ")"; }
        public float this[int i]
        {
            get { return i == 0 ? x : i == 1 ? y : z; }
            set { if (i == 0) x = value; else if (i == 1) y = value; else z = value; }
        }
    }

    public struct Vector4
    {
        public float x, y, z, w;
        public Vector4(float x, float y, float z, float w) { this.x = x; this.y = y; this.z = z; this.w = w; }
        public static implicit operator Vector3(Vector4 v) { return new Vector3(v.x, v.y, v.z); }
    }

    public struct Quaternion
    {
        public float x, y, z, w;
        public Quaternion(float x, float y, float z, float w) { this.x = x; this.y = y; this.z = z; this.w = w; }
        public static Quaternion identity => new Quaternion(0, 0, 0, 1);

        public static Quaternion operator *(Quaternion a, Quaternion b)
        {
            return new Quaternion(
                a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
                a.w * b.y + a.y * b.w + a.z * b.x - a.x * b.z,
                a.w * b.z + a.z * b.w + a.x * b.y - a.y * b.x,
                a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z);
        }

        public static Vector3 operator *(Quaternion q, Vector3 v)
        {
            Vector3 u = new Vector3(q.x, q.y, q.z);
            Vector3 t = 2f * Vector3.Cross(u, v);
            return v + q.w * t + Vector3.Cross(u, t);
        }

        public static Quaternion Inverse(Quaternion q) { return new Quaternion(-q.x, -q.y, -q.z, q.w); }

        public static Quaternion AngleAxis(float degrees, Vector3 axis)
        {
            double half = degrees * Math.PI / 360.0;
            Vector3 n = axis.normalized * (float)Math.Sin(half);
            return new Quaternion(n.x, n.y, n.z, (float)Math.Cos(half));
        }

        public static Quaternion FromToRotation(Vector3 from, Vector3 to)
        {
            Vector3 a = from.normalized, b = to.normalized, axis = Vector3.Cross(a, b);
            float w = 1f + Vector3.Dot(a, b);
            if (w < 1e-6f) return AngleAxis(180f, Math.Abs(a.x) < 0.9f ? Vector3.Cross(a, Vector3.right) : Vector3.Cross(a, Vector3.up));
            float s = 1f / Mathf.Sqrt(axis.sqrMagnitude + w * w);
            return new Quaternion(axis.x * s, axis.y * s, axis.z * s, w * s);
        }

        public static Quaternion LookRotation(Vector3 forward, Vector3 up)
        {
            Vector3 z = forward.normalized, x = Vector3.Cross(up, z).normalized, y = Vector3.Cross(z, x);
            double m00 = x.x, m10 = x.y, m20 = x.z, m01 = y.x, m11 = y.y, m21 = y.z, m02 = z.x, m12 = z.y, m22 = z.z;
            double t = m00 + m11 + m22;
            if (t > 0.0)
            {
                double s = Math.Sqrt(1.0 + t) * 2.0;
                return Of((m21 - m12) / s, (m02 - m20) / s, (m10 - m01) / s, s / 4.0);
            }
            if (m00 > m11 && m00 > m22)
            {
                double s = Math.Sqrt(1.0 + m00 - m11 - m22) * 2.0;
                return Of(s / 4.0, (m01 + m10) / s, (m02 + m20) / s, (m21 - m12) / s);
            }
            if (m11 > m22)
            {
                double s = Math.Sqrt(1.0 + m11 - m00 - m22) * 2.0;
                return Of((m01 + m10) / s, s / 4.0, (m12 + m21) / s, (m02 - m20) / s);
            }
            double r = Math.Sqrt(1.0 + m22 - m00 - m11) * 2.0;
            return Of((m02 + m20) / r, (m12 + m21) / r, r / 4.0, (m10 - m01) / r);
        }

        private static Quaternion Of(double x, double y, double z, double w)
        {
            return new Quaternion((float)x, (float)y, (float)z, (float)w);
        }
    }

    public struct Matrix4x4
    {
        public float m00, m10, m20, m30, m01, m11, m21, m31, m02, m12, m22, m32, m03, m13, m23, m33;

        public static Matrix4x4 identity => TRS(Vector3.zero, Quaternion.identity, Vector3.one);

        public static Matrix4x4 TRS(Vector3 p, Quaternion q, Vector3 s)
        {
            Vector3 x = q * Vector3.right * s.x, y = q * Vector3.up * s.y, z = q * Vector3.forward * s.z;
            return new Matrix4x4
            {
                m00 = x.x, m10 = x.y, m20 = x.z, m01 = y.x, m11 = y.y, m21 = y.z, m02 = z.x, m12 = z.y, m22 = z.z,
                m03 = p.x, m13 = p.y, m23 = p.z, m33 = 1f,
            };
        }

        public Vector4 GetColumn(int i)
        {
            switch (i)
            {
                case 0: return new Vector4(m00, m10, m20, m30);
                case 1: return new Vector4(m01, m11, m21, m31);
                case 2: return new Vector4(m02, m12, m22, m32);
                default: return new Vector4(m03, m13, m23, m33);
            }
        }

        private Vector3 Axis(int i) { return GetColumn(i); }

        public Vector3 MultiplyVector(Vector3 v) { return Axis(0) * v.x + Axis(1) * v.y + Axis(2) * v.z; }

        public Vector3 MultiplyPoint3x4(Vector3 v) { return MultiplyVector(v) + Axis(3); }

        // The matrices of the package are affine.
        public static Matrix4x4 operator *(Matrix4x4 a, Matrix4x4 b)
        {
            return Columns(a.MultiplyVector(b.Axis(0)), a.MultiplyVector(b.Axis(1)), a.MultiplyVector(b.Axis(2)),
                a.MultiplyPoint3x4(b.Axis(3)));
        }

        public Matrix4x4 inverse
        {
            get
            {
                Vector3 x = Axis(0), y = Axis(1), z = Axis(2), p = Axis(3);
                float volume = Vector3.Dot(x, Vector3.Cross(y, z));
                Vector3 rx = Vector3.Cross(y, z) * (1f / volume), ry = Vector3.Cross(z, x) * (1f / volume),
                    rz = Vector3.Cross(x, y) * (1f / volume);
                Matrix4x4 linear = Columns(new Vector3(rx.x, ry.x, rz.x), new Vector3(rx.y, ry.y, rz.y),
                    new Vector3(rx.z, ry.z, rz.z), Vector3.zero);
                Vector3 back = -linear.MultiplyVector(p);
                linear.m03 = back.x;
                linear.m13 = back.y;
                linear.m23 = back.z;
                return linear;
            }
        }

        private static Matrix4x4 Columns(Vector3 x, Vector3 y, Vector3 z, Vector3 p)
        {
            return new Matrix4x4
            {
                m00 = x.x, m10 = x.y, m20 = x.z, m01 = y.x, m11 = y.y, m21 = y.z, m02 = z.x, m12 = z.y, m22 = z.z,
                m03 = p.x, m13 = p.y, m23 = p.z, m33 = 1f,
            };
        }
    }

    public struct Bounds
    {
        private Vector3 middle, half;
        public Bounds(Vector3 center, Vector3 size) { middle = center; half = size * 0.5f; }
        public Vector3 center => middle;
        public Vector3 size => half * 2f;
        public Vector3 min => middle - half;
        public Vector3 max => middle + half;
        public void SetMinMax(Vector3 min, Vector3 max)
        {
            half = (max - min) * 0.5f;
            middle = min + half;
        }
    }

    public struct Color
    {
        public float r, g, b, a;
        public Color(float r, float g, float b, float a = 1f) { this.r = r; this.g = g; this.b = b; this.a = a; }
    }
}
