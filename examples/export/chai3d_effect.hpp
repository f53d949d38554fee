// The exported force as an effect of CHAI3D.
//
//     auto *surface = new chai3d::cShapeBox(0.2, 0.2, 0.02);   // or any object of the scene
//     surface->addEffect(new TextureEffect(surface));
//
// CHAI3D hands positions over in the frame of the object, in the unit of the scene. Turn and
// place the object so that its z comes out of the textured wall and its origin lies on it. The
// effect knows by itself where contact begins; remove the object's effect of a plain surface.
#pragma once

#include "chai3d.h"

#include "texture.h"

class TextureEffect : public chai3d::cGenericEffect
{
public:
    // a_metresPerUnit: 1 if the scene is in metres, 1e-3 if it is in millimetres.
    explicit TextureEffect(chai3d::cGenericObject *a_parent, double a_metresPerUnit = 1.0)
        : chai3d::cGenericEffect(a_parent), m_metresPerUnit(a_metresPerUnit)
    {
        for (texture_state &state : m_states) {
            texture_reset(&state);
        }
    }

    bool computeForce(const chai3d::cVector3d &a_toolPos, const chai3d::cVector3d & /*a_toolVel*/,
                      const unsigned int &a_toolID, chai3d::cVector3d &a_reactionForce) override
    {
        if (a_toolID >= c_tools) {
            a_reactionForce.zero();
            return false;
        }
        const double position[3] = {m_metresPerUnit * a_toolPos.x(),
                                    m_metresPerUnit * a_toolPos.y(),
                                    m_metresPerUnit * a_toolPos.z()};
        double force[3];
        texture_force(&m_states[a_toolID], position, force);
        a_reactionForce.set(force[0], force[1], force[2]);
        return force[0] != 0.0 || force[1] != 0.0 || force[2] != 0.0;
    }

private:
    static constexpr unsigned int c_tools = 16; // as many as CHAI3D's own effects know
    double m_metresPerUnit;
    texture_state m_states[c_tools];
};
