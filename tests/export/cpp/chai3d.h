// A stand-in for CHAI3D 3, written for this test: the signatures that an effect meets.
#pragma once

namespace chai3d {

class cVector3d
{
public:
    cVector3d(const double& a_x = 0.0, const double& a_y = 0.0, const double& a_z = 0.0)
        : m_x(a_x), m_y(a_y), m_z(a_z) {}
    double x() const { return m_x; }
    double y() const { return m_y; }
    double z() const { return m_z; }
    void zero() { set(0.0, 0.0, 0.0); }
    void set(const double& a_x, const double& a_y, const double& a_z)
    {
        m_x = a_x;
        m_y = a_y;
        m_z = a_z;
    }

private:
    double m_x, m_y, m_z;
};

class cGenericEffect;

class cGenericObject
{
public:
    void addChild(cGenericObject*) {}
    void addEffect(cGenericEffect*) {}
    void setLocalPos(const double, const double, const double = 0.0) {}
    void rotateAboutGlobalAxisDeg(const double, const double, const double, const double) {}
};

class cWorld : public cGenericObject {};

class cGenericTool : public cGenericObject
{
public:
    double getWorkspaceScaleFactor() { return 1.0; }
};

class cGenericEffect
{
public:
    cGenericEffect(cGenericObject* a_parent) : m_parent(a_parent) {}
    virtual ~cGenericEffect() {}
    virtual bool computeForce(const cVector3d& a_toolPos, const cVector3d& a_toolVel,
                              const unsigned int& a_toolID, cVector3d& a_reactionForce) = 0;

protected:
    cGenericObject* m_parent;
};

} // namespace chai3d
